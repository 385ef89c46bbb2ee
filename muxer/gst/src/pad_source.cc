// SPDX-License-Identifier: BSD-3-Clause
#include "pad_source.h"

#include <algorithm>
#include <cstring>

namespace isoreel::gst {
namespace {

constexpr std::uint64_t kAhead =
    1u << 20;  // of what is asked for, before who pushes has to wait; and worth skipping
constexpr std::uint64_t kBehind = 4u << 20;  // kept of what was read, where upstream can seek

std::optional<std::uint64_t> peerBytes(GstPad* pad) {
  gint64 bytes = 0;
  if (!gst_pad_peer_query_duration(pad, GST_FORMAT_BYTES, &bytes) || bytes < 0) return {};
  return static_cast<std::uint64_t>(bytes);
}

// What upstream reads from, as the command line calls it.
std::string peerName(GstPad* pad) {
  std::string name = "input";
  GstQuery* query = gst_query_new_uri();
  gchar* uri = nullptr;
  if (gst_pad_peer_query(pad, query)) gst_query_parse_uri(query, &uri);
  gst_query_unref(query);
  if (uri != nullptr) {
    gchar* path = g_filename_from_uri(uri, nullptr, nullptr);
    name = path != nullptr ? path : uri;
    g_free(path);
  }
  g_free(uri);
  return name;
}

class PullSource final : public ByteSource {
 public:
  explicit PullSource(GstPad* pad) : pad_(pad), name_(peerName(pad)) {}

  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    std::size_t done = 0;
    while (done < out.size()) {
      const auto count = static_cast<guint>(std::min<std::size_t>(out.size() - done, 1u << 26));
      GstBuffer* buffer = nullptr;
      const GstFlowReturn flow = gst_pad_pull_range(pad_, offset + done, count, &buffer);
      if (flow == GST_FLOW_EOS) break;
      if (flow != GST_FLOW_OK)
        return {ErrorCode::kIo, std::string("cannot be read: ") + gst_flow_get_name(flow)};
      const std::size_t got = gst_buffer_extract(buffer, 0, out.data() + done, count);
      gst_buffer_unref(buffer);
      done += got;
      if (got < count) break;
    }
    return done;
  }
  std::optional<std::uint64_t> size() const override { return peerBytes(pad_); }
  std::string name() const override { return name_; }

 private:
  GstPad* pad_;
  std::string name_;
};

}  // namespace

std::unique_ptr<ByteSource> pullSource(GstPad* pad) { return std::make_unique<PullSource>(pad); }

class PushFeed::Source final : public ByteSource {
 public:
  explicit Source(PushFeed& feed) : feed_(feed) {
    const std::lock_guard lock(feed_.mutex_);
    feed_.sources_.push_back(this);
  }
  ~Source() override {
    const std::lock_guard lock(feed_.mutex_);
    std::erase(feed_.sources_, this);
  }
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    return feed_.read(*this, offset, out);
  }
  std::optional<std::uint64_t> size() const override { return feed_.seekable_ ? feed_.size_ : std::nullopt; }
  std::string name() const override { return feed_.name_; }

  std::uint64_t position = 0;  // of what is read next, if it is read front to back

 private:
  PushFeed& feed_;
};

std::unique_ptr<ByteSource> PushFeed::source() { return std::make_unique<Source>(*this); }

std::uint64_t PushFeed::kept() {
  const std::lock_guard lock(mutex_);
  return window_.size();
}

GstFlowReturn PushFeed::take(GstBuffer* buffer) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return stopped_ || flushing_ || start_ + window_.size() < wanted_ + kAhead; });
  if (stopped_ || flushing_) return GST_FLOW_FLUSHING;
  const std::size_t had = window_.size(), more = gst_buffer_get_size(buffer);
  window_.resize(had + more);
  gst_buffer_extract(buffer, 0, window_.data() + had, more);
  begun_ = true;
  changed_.notify_all();
  return GST_FLOW_OK;
}

void PushFeed::takeSegment(const GstSegment& segment) {
  const std::lock_guard lock(mutex_);
  if (segment.format == GST_FORMAT_BYTES && segment.start != start_ + window_.size()) {
    window_.clear();
    start_ = segment.start;
  }
  arriving_ = false;
  eos_ = false;
  changed_.notify_all();
}

void PushFeed::takeEos() {
  const std::lock_guard lock(mutex_);
  eos_ = begun_ = true;
  changed_.notify_all();
}

bool PushFeed::ownSeek(GstEvent* flush) {
  const std::lock_guard lock(mutex_);
  return own_seek_ != 0 && gst_event_get_seqnum(flush) == own_seek_;
}

void PushFeed::flushStart() {
  const std::lock_guard lock(mutex_);
  flushing_ = true;
  changed_.notify_all();
}

void PushFeed::flushStop() {
  const std::lock_guard lock(mutex_);
  flushing_ = eos_ = false;
  start_ += window_.size();
  window_.clear();
  changed_.notify_all();
}

void PushFeed::reset() {
  const std::lock_guard lock(mutex_);
  window_.clear();
  start_ = wanted_ = read_at_ = 0;
  size_.reset();
  own_seek_ = 0;
  keep_all_ = true;
  seekable_ = arriving_ = eos_ = interrupted_ = flushing_ = begun_ = false;
}

void PushFeed::stop(bool stopped) {
  const std::lock_guard lock(mutex_);
  stopped_ = stopped;
  changed_.notify_all();
}

void PushFeed::interrupt(bool interrupted) {
  const std::lock_guard lock(mutex_);
  interrupted_ = interrupted;
  changed_.notify_all();
}

Result<bool> PushFeed::begin() {
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return stopped_ || interrupted_ || begun_; });
    if (!begun_) return {ErrorCode::kIo, "reading was stopped"};
    if (start_ != 0)
      return {ErrorCode::kInvalidArgument, "the bytes that came are not those from the file's start on"};
  }
  gboolean seekable = FALSE;
  GstQuery* query = gst_query_new_seeking(GST_FORMAT_BYTES);
  if (gst_pad_peer_query(pad_, query)) gst_query_parse_seeking(query, nullptr, &seekable, nullptr, nullptr);
  gst_query_unref(query);
  const auto size = peerBytes(pad_);
  name_ = peerName(pad_);
  const std::lock_guard lock(mutex_);
  size_ = size;
  seekable_ = seekable != FALSE && size.has_value();
  return seekable_;
}

// Asks upstream for bytes from `offset` on. Upstream flushes us on this very thread, so nothing is locked
// meanwhile.
bool PushFeed::seek(std::unique_lock<std::mutex>& lock, std::uint64_t offset) {
  GstEvent* event = gst_event_new_seek(1.0, GST_FORMAT_BYTES, GST_SEEK_FLAG_FLUSH, GST_SEEK_TYPE_SET,
                                       static_cast<gint64>(offset), GST_SEEK_TYPE_NONE, -1);
  own_seek_ = gst_event_get_seqnum(event);
  arriving_ = true;
  wanted_ = offset;
  lock.unlock();
  const bool done = gst_pad_push_event(pad_, event) != FALSE;
  lock.lock();
  if (!done) arriving_ = false;
  return done;
}

// What no reader needs.
void PushFeed::drop() {
  std::uint64_t keep = start_;
  if (seekable_) {
    keep = read_at_ - std::min(read_at_, kBehind);
  } else if (!keep_all_) {
    keep = start_ + window_.size();
    for (const Source* source : sources_) keep = std::min(keep, source->position);
  }
  // Moving what stays costs as much as what goes.
  if (keep > start_ && keep - start_ >= window_.size() / 2) {
    const std::uint64_t count = std::min<std::uint64_t>(keep - start_, window_.size());
    window_.erase(window_.begin(), window_.begin() + static_cast<std::ptrdiff_t>(count));
    start_ += count;
  }
}

Result<std::size_t> PushFeed::read(Source& source, std::uint64_t offset, std::span<std::uint8_t> out) {
  std::unique_lock lock(mutex_);
  std::size_t done = 0;
  while (done < out.size()) {
    const std::uint64_t at = offset + done;
    if (stopped_ || interrupted_) return {ErrorCode::kIo, "reading was stopped"};
    const std::uint64_t end = start_ + window_.size();
    if (!arriving_ && at >= start_ && at < end) {
      const std::size_t count = std::min<std::size_t>(out.size() - done, static_cast<std::size_t>(end - at));
      std::memcpy(out.data() + done, window_.data() + (at - start_), count);
      done += count;
      source.position = read_at_ = wanted_ = at + count;
      drop();
      changed_.notify_all();
      continue;
    }
    if (!arriving_ && seekable_ && size_ && at >= *size_) break;
    if (!arriving_ && seekable_ && (at < start_ || at > end + kAhead || (eos_ && at >= end))) {
      if (!seek(lock, at)) return {ErrorCode::kIo, "cannot be read at byte " + std::to_string(at)};
      continue;
    }
    if (!arriving_ && at < start_) return {ErrorCode::kIo, "byte " + std::to_string(at) + " has gone by"};
    if (!arriving_ && eos_) break;
    wanted_ = at + (out.size() - done);
    source.position = read_at_ = at;
    if (!arriving_) drop();
    changed_.notify_all();
    changed_.wait(lock);
  }
  return done;
}

}  // namespace isoreel::gst
