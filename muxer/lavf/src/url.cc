// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/lavf/url.h>

#include <algorithm>
#include <filesystem>

#include "av.h"

namespace isoreel::lavf {
namespace {

constexpr std::uint64_t kTailBytes = std::uint64_t{1} << 18;
constexpr std::uint64_t kSkipBytes = std::uint64_t{1} << 20;  // sooner read and dropped than asked for anew
constexpr std::size_t kRecentBytes = std::size_t{1} << 23;
constexpr const char* kPatience = "30000000";  // microseconds

int asksToStop(void* stopped) { return (*static_cast<std::function<bool()>*>(stopped))() ? 1 : 0; }

/// One connection at a time that is read forward; over HTTP a new one, from another byte on, is a request.
class UrlSource final : public ByteSource {
 public:
  UrlSource(std::string url, std::function<bool()> stopped)
      : url_(std::move(url)),
        http_(url_.starts_with("http:") || url_.starts_with("https:")),
        stopped_(stopped ? std::move(stopped) : [] { return false; }) {}

  Status open() {
    ISOREEL_ASSIGN(connection_, connect(0));
    const std::int64_t size = avio_size(connection_.get());
    if ((connection_->seekable & AVIO_SEEKABLE_NORMAL) == 0 || size < 0) return {};
    size_ = static_cast<std::uint64_t>(size);
    return *size_ <= kTailBytes ? readTail(*connection_, 0) : Status();
  }

  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    if (size_) {
      if (offset >= *size_) return std::size_t{0};
      out = out.first(static_cast<std::size_t>(std::min<std::uint64_t>(out.size(), *size_ - offset)));
      const std::uint64_t tail = *size_ - std::min(*size_, kTailBytes);
      if (offset >= tail) {
        if (http_ && tail_.empty()) {
          // Beside the connection that is there, which stays good for what it was reading.
          ISOREEL_ASSIGN(const Owner<AVIOContext> another, connect(tail));
          ISOREEL_TRY(readTail(*another, tail));
        }
        if (!tail_.empty()) {
          const auto from = tail_.begin() + static_cast<std::ptrdiff_t>(offset - tail);
          std::copy_n(from, out.size(), out.begin());
          return out.size();
        }
      }
    }
    std::size_t known = 0;
    if (offset < position_ && position_ - offset <= recent_.size()) {
      const auto from = recent_.end() - static_cast<std::ptrdiff_t>(position_ - offset);
      known = static_cast<std::size_t>(std::min<std::uint64_t>(out.size(), position_ - offset));
      std::copy_n(from, known, out.begin());
      if (known == out.size()) return known;
    }
    ISOREEL_TRY(goTo(offset + known));
    ISOREEL_ASSIGN(const std::size_t got, advance(out.subspan(known)));
    if (size_ && known + got < out.size()) return failure("ends early, at byte " + std::to_string(position_));
    return known + got;
  }
  std::optional<std::uint64_t> size() const override { return size_; }
  std::string name() const override { return url_; }

 private:
  Error failure(const std::string& what) const { return {ErrorCode::kIo, what}; }

  Result<Owner<AVIOContext>> connect(std::uint64_t offset) {
    Options options;
    options.set("rw_timeout", kPatience);
    if (http_ && offset > 0) options.set("offset", std::to_string(offset));
    const AVIOInterruptCB interrupt{asksToStop, &stopped_};
    AVIOContext* context = nullptr;
    const int code = avio_open2(&context, url_.c_str(), AVIO_FLAG_READ, &interrupt, options.get());
    if (code >= 0) return Owner<AVIOContext>(context);
    const bool missing = code == AVERROR_HTTP_NOT_FOUND || code == AVERROR(ENOENT);
    return {missing ? ErrorCode::kNotFound : ErrorCode::kIo, "cannot open: " + reason(code)};
  }

  Result<std::size_t> fill(AVIOContext& from, std::span<std::uint8_t> out) {
    std::size_t done = 0;
    while (done < out.size()) {
      const int part = static_cast<int>(std::min<std::size_t>(out.size() - done, 1 << 30));
      const int got = avio_read(&from, out.data() + done, part);
      if (got == 0 || got == AVERROR_EOF) break;
      if (got < 0) return failure("cannot read: " + reason(got));
      done += static_cast<std::size_t>(got);
    }
    return done;
  }

  /// Reads on where the connection is, and remembers what was read last.
  Result<std::size_t> advance(std::span<std::uint8_t> out) {
    ISOREEL_ASSIGN(const std::size_t got, fill(*connection_, out));
    position_ += got;
    recent_.insert(recent_.end(), out.begin(), out.begin() + static_cast<std::ptrdiff_t>(got));
    if (recent_.size() > 2 * kRecentBytes)
      recent_.erase(recent_.begin(), recent_.end() - static_cast<std::ptrdiff_t>(kRecentBytes));
    return got;
  }

  Status readTail(AVIOContext& from, std::uint64_t start) {
    Bytes tail(static_cast<std::size_t>(*size_ - start));
    ISOREEL_ASSIGN(const std::size_t got, fill(from, tail));
    if (got < tail.size()) return failure("ends early, at byte " + std::to_string(start + got));
    tail_ = std::move(tail);
    return {};
  }

  Status goTo(std::uint64_t offset) {
    if (offset < position_ && !size_)
      return {ErrorCode::kInvalidArgument, "cannot go back to byte " + std::to_string(offset)};
    if (offset >= position_ && (!size_ || offset - position_ <= kSkipBytes)) return skipTo(offset);
    if (http_) {
      ISOREEL_ASSIGN(connection_, connect(offset));
    } else if (const std::int64_t at =
                   avio_seek(connection_.get(), static_cast<std::int64_t>(offset), SEEK_SET);
               at < 0) {
      return failure("cannot go to byte " + std::to_string(offset) + ": " + reason(static_cast<int>(at)));
    }
    position_ = offset;
    recent_.clear();
    return {};
  }

  Status skipTo(std::uint64_t offset) {
    Bytes scratch(static_cast<std::size_t>(std::min<std::uint64_t>(offset - position_, 65536)));
    while (position_ < offset) {
      const auto count =
          static_cast<std::size_t>(std::min<std::uint64_t>(offset - position_, scratch.size()));
      ISOREEL_ASSIGN(const std::size_t got, advance(std::span(scratch).first(count)));
      if (got == 0) break;
    }
    return {};
  }

  const std::string url_;
  const bool http_;
  std::function<bool()> stopped_;
  Owner<AVIOContext> connection_;
  std::uint64_t position_ = 0;  // of the connection
  std::optional<std::uint64_t> size_;
  Bytes recent_;  // that end at `position_`
  Bytes tail_;
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
