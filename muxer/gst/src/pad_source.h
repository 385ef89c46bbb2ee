// SPDX-License-Identifier: BSD-3-Clause
// The bytes that a sink pad gets, as the library's byte sources.
#pragma once

#include <gst/gst.h>
#include <isoreel/container/byte_source.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace isoreel::gst {

/// Pulls from the peer of `pad`, which must outlive the source. Seekable when upstream knows its length; that
/// is asked for anew each time, so that a file may grow.
std::unique_ptr<ByteSource> pullSource(GstPad* pad);

/// What is pushed into a sink pad, for readers on another thread. Bytes are kept until they are read, about a
/// mebibyte in advance; who pushes more waits. Where upstream can seek by bytes, readers may read anywhere:
/// the feed then asks upstream to push from there, and keeps what it knows to save going back and forth.
class PushFeed {
 public:
  /// `pad` must outlive the feed.
  explicit PushFeed(GstPad* pad) : pad_(pad) {}

  // For the pad's functions.
  GstFlowReturn take(GstBuffer* buffer);
  void takeSegment(const GstSegment& segment);
  void takeEos();
  /// Whether a flush is one of our own: nobody else needs to know.
  bool ownSeek(GstEvent* flush);
  void flushStart();
  void flushStop();

  /// Before the first byte, when nobody reads.
  void reset();
  /// From now on pushing and reading fail, or no longer.
  void stop(bool stopped);
  /// Reading fails, until it may again; pushing waits.
  void interrupt(bool interrupted);

  // For readers.
  /// Waits for the first bytes or the end; whether upstream can seek by bytes and knows its length. kIo when
  /// stopped.
  Result<bool> begin();
  /// A reader of what is pushed; the feed must outlive it. All readers there are must read on, or be gone:
  /// what the slowest has not read is kept.
  std::unique_ptr<ByteSource> source();
  /// Bytes kept.
  std::uint64_t kept();
  /// Readers that came so far are all: what all have read may go.
  void release() { keep_all_ = false; }

 private:
  class Source;
  Result<std::size_t> read(Source& source, std::uint64_t offset, std::span<std::uint8_t> out);
  bool seek(std::unique_lock<std::mutex>& lock, std::uint64_t offset);
  void drop();

  GstPad* pad_;
  std::string name_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Source*> sources_;
  Bytes window_;  // bytes [start_, start_ + window_.size()) of the stream
  std::uint64_t start_ = 0;
  std::uint64_t wanted_ = 0;   // end of what a reader asked for last
  std::uint64_t read_at_ = 0;  // where it read last
  std::optional<std::uint64_t> size_;
  guint32 own_seek_ = 0;  // sequence number of our seek that is under way
  bool seekable_ = false, keep_all_ = true,
       arriving_ = false;  // arriving_: the segment of a seek is waited for
  bool eos_ = false, stopped_ = false, interrupted_ = false, flushing_ = false, begun_ = false;
};

}  // namespace isoreel::gst
