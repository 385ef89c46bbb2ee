// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/lavf/url.h>

#include <algorithm>
#include <filesystem>

#include "av.h"
#include "byte_ranges.h"

extern "C" {
#include <libavutil/opt.h>
}

namespace isoreel::lavf {
namespace {

constexpr std::uint64_t kHeadBytes = std::uint64_t{1} << 16;
constexpr std::uint64_t kTailBytes = std::uint64_t{1} << 19;
constexpr std::uint64_t kPartHeads = std::uint64_t{1}
                                     << 12;  // of an answer with two parts, all but the parts
constexpr std::uint64_t kSkipBytes = std::uint64_t{1} << 20;  // sooner read and dropped than asked for anew
constexpr std::size_t kRecentBytes = std::size_t{1} << 23;
constexpr const char* kPatience = "30000000";  // microseconds

int asksToStop(void* stopped) { return (*static_cast<std::function<bool()>*>(stopped))() ? 1 : 0; }

Error failure(const std::string& what) { return {ErrorCode::kIo, what}; }

/// Fills `out` as far as the connection goes. `status`: why it goes no further; fine at the end.
std::size_t fill(AVIOContext& from, std::span<std::uint8_t> out, Status& status) {
  std::size_t done = 0;
  while (done < out.size()) {
    const int part = static_cast<int>(std::min<std::size_t>(out.size() - done, 1 << 30));
    const int got = avio_read(&from, out.data() + done, part);
    if (got == 0 || got == AVERROR_EOF) break;
    if (got < 0) {
      status = failure("cannot read: " + reason(got));
      break;
    }
    done += static_cast<std::size_t>(got);
  }
  return done;
}

/// One connection at a time that is read forward; over HTTP a new one, from another byte on, is a request.
class UrlSource final : public ByteSource {
 public:
  UrlSource(std::string url, std::function<bool()> stopped)
      : url_(std::move(url)),
        http_(url_.starts_with("http:") || url_.starts_with("https:")),
        stopped_(stopped ? std::move(stopped) : [] { return false; }) {}

  Status open() {
    if (http_) {
      ISOREEL_TRY(openEnds());
      if (size_) return {};
    }
    ISOREEL_TRY(startAt(0));
    return takeSize();
  }

  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    if (size_) {
      if (offset >= *size_) return std::size_t{0};
      out = out.first(static_cast<std::size_t>(std::min<std::uint64_t>(out.size(), *size_ - offset)));
      if (http_ && offset >= tailStart()) ISOREEL_TRY(fetchTail());
    }
    std::size_t done = 0;
    while (const std::size_t more = copyKnown(offset + done, out.subspan(done))) done += more;
    while (done < out.size()) {
      const bool fresh = connection_ == nullptr;
      ISOREEL_TRY(goTo(offset + done));
      Status status;
      const std::size_t got = advance(out.subspan(done), status);
      done += got;
      if (done == out.size()) break;
      if (!size_) {  // the end of it, then
        ISOREEL_TRY(status);
        break;
      }
      if (!http_ || (fresh && got == 0))
        return status.ok() ? failure("ends early, at byte " + std::to_string(position_)) : status;
      connection_.reset();  // the server hung up: once more, from here on
    }
    return done;
  }
  std::optional<std::uint64_t> size() const override { return size_; }
  std::string name() const override { return url_; }

 private:
  /// `code`: libavformat's.
  Status cannotOpen(int code) const {
    const bool missing = code == AVERROR_HTTP_NOT_FOUND || code == AVERROR(ENOENT);
    return {missing ? ErrorCode::kNotFound : ErrorCode::kIo, "cannot open: " + reason(code)};
  }

  /// Below 0: libavformat's code for what went wrong.
  int connect(Options& options, Owner<AVIOContext>& connection) {
    options.set("rw_timeout", kPatience);
    const AVIOInterruptCB interrupt{asksToStop, &stopped_};
    AVIOContext* context = nullptr;
    const int code = avio_open2(&context, url_.c_str(), AVIO_FLAG_READ, &interrupt, options.get());
    connection.reset(context);
    return code;
  }

  Status startAt(std::uint64_t offset) {
    Options options;
    if (http_ && offset > 0) options.set("offset", std::to_string(offset));
    if (const int code = connect(options, connection_); code < 0) return cannotOpen(code);
    position_ = offset;
    recent_.clear();
    return {};
  }

  /// Of the connection, if it can go to any byte. A small file is read at once.
  Status takeSize() {
    const std::int64_t size = avio_size(connection_.get());
    if ((connection_->seekable & AVIO_SEEKABLE_NORMAL) == 0 || size < 0) return {};
    size_ = static_cast<std::uint64_t>(size);
    if (!http_ || *size_ > kHeadBytes + kTailBytes) return {};
    FilePart whole{0, *size_, Bytes(static_cast<std::size_t>(*size_))};
    Status status;
    if (fill(*connection_, whole.bytes, status) == *size_) parts_.push_back(std::move(whole));
    connection_.reset();
    return {};
  }

  /// Asks for both ends of the file at once. A server that knows no such thing sends the whole file, or an
  /// error. No size afterwards: what came is of no use.
  Status openEnds() {
    Options options;
    options.set("headers", "Range: bytes=0-" + std::to_string(kHeadBytes - 1) + ",-" +
                               std::to_string(kTailBytes) + "\r\n");
    const int code = connect(options, connection_);
    const bool refused = code == AVERROR_HTTP_BAD_REQUEST || code == AVERROR_HTTP_OTHER_4XX ||
                         code == AVERROR_HTTP_SERVER_ERROR;
    if (code < 0) return refused ? Status() : cannotOpen(code);
    std::uint8_t* type = nullptr;
    if (av_opt_get(connection_.get(), "mime_type", AV_OPT_SEARCH_CHILDREN, &type) < 0) return takeSize();
    const std::string mime(reinterpret_cast<const char*>(type));
    av_free(type);
    if (!mime.starts_with("multipart/")) return takeSize();
    Bytes body(static_cast<std::size_t>(kHeadBytes + kTailBytes + kPartHeads));
    Status status;
    body.resize(fill(*connection_, body, status));
    connection_.reset();
    for (FilePart& part : parseByteRanges(mime, body)) {
      size_ = part.file_bytes;
      parts_.push_back(std::move(part));
    }
    return {};
  }

  std::uint64_t tailStart() const { return *size_ - std::min(*size_, kTailBytes); }

  /// By a request of its own when the first one did not bring it, beside the connection that is there: that
  /// stays good for what it was reading.
  Status fetchTail() {
    const auto isTail = [&](const FilePart& part) { return part.offset + part.bytes.size() == *size_; };
    if (std::any_of(parts_.begin(), parts_.end(), isTail)) return {};
    Owner<AVIOContext> another;
    Options options;
    options.set("offset", std::to_string(tailStart()));
    if (const int code = connect(options, another); code < 0) return cannotOpen(code);
    FilePart tail{tailStart(), *size_, Bytes(static_cast<std::size_t>(*size_ - tailStart()))};
    Status status;
    const std::size_t got = fill(*another, tail.bytes, status);
    ISOREEL_TRY(status);
    if (got < tail.bytes.size()) return failure("ends early, at byte " + std::to_string(tail.offset + got));
    parts_.push_back(std::move(tail));
    return {};
  }

  /// What is in memory from `offset` on; how much that is.
  std::size_t copyKnown(std::uint64_t offset, std::span<std::uint8_t> out) const {
    const auto copy = [&](std::uint64_t start, ByteSpan bytes) {
      if (offset < start || offset - start >= bytes.size()) return std::size_t{0};
      const ByteSpan from = bytes.subspan(static_cast<std::size_t>(offset - start));
      const std::size_t count = std::min(from.size(), out.size());
      std::copy_n(from.begin(), count, out.begin());
      return count;
    };
    for (const FilePart& part : parts_) {
      if (const std::size_t count = copy(part.offset, part.bytes)) return count;
    }
    return copy(position_ - recent_.size(), recent_);
  }

  /// Reads on where the connection is, and remembers what was read last.
  std::size_t advance(std::span<std::uint8_t> out, Status& status) {
    const std::size_t got = fill(*connection_, out, status);
    position_ += got;
    recent_.insert(recent_.end(), out.begin(), out.begin() + static_cast<std::ptrdiff_t>(got));
    if (recent_.size() > 2 * kRecentBytes)
      recent_.erase(recent_.begin(), recent_.end() - static_cast<std::ptrdiff_t>(kRecentBytes));
    return got;
  }

  Status goTo(std::uint64_t offset) {
    if (connection_ && offset < position_ && !size_)
      return {ErrorCode::kInvalidArgument, "cannot go back to byte " + std::to_string(offset)};
    if (connection_ && offset >= position_ && (!size_ || offset - position_ <= kSkipBytes)) {
      skipTo(offset);
      if (position_ == offset || !size_) return {};
    }
    if (http_ || !connection_) return startAt(offset);
    const std::int64_t at = avio_seek(connection_.get(), static_cast<std::int64_t>(offset), SEEK_SET);
    if (at < 0)
      return failure("cannot go to byte " + std::to_string(offset) + ": " + reason(static_cast<int>(at)));
    position_ = offset;
    recent_.clear();
    return {};
  }

  /// As far as that goes.
  void skipTo(std::uint64_t offset) {
    Bytes scratch(static_cast<std::size_t>(std::min<std::uint64_t>(offset - position_, 65536)));
    Status status;
    while (position_ < offset) {
      const auto count =
          static_cast<std::size_t>(std::min<std::uint64_t>(offset - position_, scratch.size()));
      if (advance(std::span(scratch).first(count), status) == 0) break;
    }
  }

  const std::string url_;
  const bool http_;
  std::function<bool()> stopped_;
  Owner<AVIOContext> connection_;
  std::uint64_t position_ = 0;  // of the connection, or where it broke off
  std::optional<std::uint64_t> size_;
  Bytes recent_;                 // that end at `position_`
  std::vector<FilePart> parts_;  // that are kept
};

}  // namespace

bool isUrl(const std::string& name) {
  const std::size_t colon = name.find(':');
  if (colon == std::string::npos || colon == 0) return false;
  std::error_code ignored;
  if (std::filesystem::exists(name, ignored)) return false;
  const std::string scheme = name.substr(0, colon);
  // What it does not know as a protocol, it takes for a file's name.
  const char* protocol = avio_find_protocol_name(name.c_str());
  return protocol != nullptr && (scheme == "file" || std::string(protocol) != "file");
}

Result<std::unique_ptr<ByteSource>> openUrl(const std::string& url, std::function<bool()> stopped) {
  av_log_set_level(AV_LOG_QUIET);  // what goes wrong comes back as a Status
  auto source = std::make_unique<UrlSource>(url, std::move(stopped));
  ISOREEL_TRY(source->open().at(url));
  return std::unique_ptr<ByteSource>(std::move(source));
}

}  // namespace isoreel::lavf
