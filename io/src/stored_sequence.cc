// SPDX-License-Identifier: BSD-3-Clause
#include "src/stored_sequence.h"

#include <fmt/format.h>

#include <algorithm>

#include "src/files.h"
#include "src/mapped_file.h"

namespace isoreel::io {
namespace {

constexpr std::size_t kSlabScalars = 1u << 15;
// Readers that go through a file side by side, each in order: a GOP each. More than that, and some start
// over.
constexpr std::size_t kMaxStreams = 64;

class StoredSequence : public VolumeSequence {
 public:
  explicit StoredSequence(StoredVolumes stored) : stored_(std::move(stored)) {}
  std::size_t size() const override { return stored_.volumes; }
  const Grid& grid() const override { return stored_.grid; }
  bool levelSet() const override { return stored_.levelSet; }
  std::optional<double> time(std::size_t i) const override { return stored_.time(i); }
  std::string name(std::size_t i) const override { return stored_.name(i); }

  // All sizes: a user should not learn of frame 900 after an hour.
  Status check() {
    std::uint64_t samples = stored_.grid.nodeCount();  // at most 2^48
    if (__builtin_mul_overflow(samples, stored_.volumes, &samples) || samples > (std::uint64_t{1} << 59)) {
      return {ErrorCode::kLimit, fmt::format("{}: {} volumes are too many", stored_.header, stored_.volumes)};
    }
    if (samples % stored_.parts.size() != 0) {
      return {ErrorCode::kBadData, fmt::format("{}: {} samples cannot lie in {} files of one size",
                                               stored_.header, samples, stored_.parts.size())};
    }
    for (const StoredVolumes::Part& part : stored_.parts) {
      if (part.offset >> 62 != 0 || stored_.skip >> 62 != 0)
        return {ErrorCode::kLimit, fmt::format("{}: samples after byte 2^62", stored_.header)};
    }
    partBytes_ = samples / stored_.parts.size() * scalarBytes(stored_.type);
    for (const StoredVolumes::Part& part : stored_.parts) ISOREEL_TRY(checkPart(part));
    return {};
  }

  Result<Volume> read(std::size_t i) override {
    const std::uint64_t bytes = stored_.grid.nodeCount() * scalarBytes(stored_.type);
    const std::uint64_t begin = i * bytes;
    // Again and before the memory for it: files change.
    for (std::uint64_t p = begin / partBytes_; p * partBytes_ < begin + bytes; ++p)
      ISOREEL_TRY(checkPart(stored_.parts[p]));
    if (mayMap(begin)) return map(begin);
    position_ = begin;
    ISOREEL_TRY(takeStream());
    Result<Volume> volume = readOn();
    if (volume.ok() && stream_) waiting_.push_back({position_, std::move(stream_)});
    stream_.reset();
    const std::size_t most = stored_.coding == Coding::kPlain ? 1 : kMaxStreams;
    if (waiting_.size() > most) waiting_.erase(waiting_.begin());
    return volume;
  }

 private:
  Status checkPart(const StoredVolumes::Part& part) const {
    const std::uint64_t expected = part.offset + stored_.skip + partBytes_;
    Result<std::uint64_t> size = regularFileSize(part.path);
    if (!size.ok()) return part.path == stored_.header ? size.status() : size.status().at(stored_.header);
    const bool plain = stored_.coding == Coding::kPlain;
    if (plain ? *size == expected
              : *size >= part.offset && (*size - part.offset) >= partBytes_ / kMaxInflation) {
      return {};
    }
    const auto& n = stored_.grid.nodes;
    const std::string what = fmt::format("{} says {}{} x {} x {} nodes of {} bytes{}{}",
                                         part.path == stored_.header ? "its header" : stored_.header,
                                         stored_.volumes > 1 ? fmt::format("{} times ", stored_.volumes) : "",
                                         n[0], n[1], n[2], scalarBytes(stored_.type),
                                         stored_.parts.size() > 1 && stored_.parts.size() != stored_.volumes
                                             ? fmt::format(" in {} files", stored_.parts.size())
                                             : "",
                                         part.offset != 0 ? fmt::format(" after {}", part.offset) : "");
    if (!plain) {
      return {ErrorCode::kTruncated, fmt::format("{}: {} bytes of compressed data cannot hold {} ({})",
                                                 part.path, *size, partBytes_, what)};
    }
    return {*size < expected ? ErrorCode::kTruncated : ErrorCode::kBadData,
            fmt::format("{}: expected {} bytes ({}), found {}", part.path, expected, what, *size)};
  }

  // Floats that lie ready in one file need no copy.
  bool mayMap(std::uint64_t begin) const {
    const std::uint64_t volumeBytes = stored_.grid.nodeCount() * sizeof(float);
    const std::uint64_t start = stored_.skip + stored_.parts[begin / partBytes_].offset;
    return stored_.type == ScalarType::kFloat32 && stored_.order == std::endian::native &&
           stored_.coding == Coding::kPlain && stored_.rescale == Rescale() && start % alignof(float) == 0 &&
           partBytes_ % volumeBytes == 0;
  }

  Result<Volume> map(std::uint64_t begin) const {
    const StoredVolumes::Part& part = stored_.parts[begin / partBytes_];
    const std::uint64_t start = part.offset + stored_.skip;
    ISOREEL_ASSIGN(std::shared_ptr<const MappedFile> file, MappedFile::open(part.path, start + partBytes_));
    const auto* samples = reinterpret_cast<const float*>(file->bytes().data() + start + begin % partBytes_);
    return Volume{stored_.grid, {samples, stored_.grid.nodeCount()}, file};
  }

  // To stream_ the one that waits at position_; or for deflated data, which have to be read from the start of
  // their file, a copy of the nearest before it: whoever left it there comes back for it.
  Status takeStream() {
    stream_.reset();
    auto nearest = waiting_.end();
    for (auto i = waiting_.begin(); i != waiting_.end(); ++i) {
      if (i->position <= position_ && i->position / partBytes_ == position_ / partBytes_ &&
          (nearest == waiting_.end() || i->position > nearest->position))
        nearest = i;
    }
    if (nearest == waiting_.end()) return {};
    const std::uint64_t ahead = position_ - nearest->position;
    if (ahead == 0) {
      stream_ = std::move(nearest->stream);
      waiting_.erase(nearest);
    } else if (stored_.coding != Coding::kPlain) {
      ISOREEL_ASSIGN(stream_, nearest->stream->copy());
      ISOREEL_TRY(stream_->skip(ahead));
    }
    return {};
  }

  // The volume at position_, where the stream stands if there is one.
  Result<Volume> readOn() {
    std::vector<float> values(stored_.grid.nodeCount());
    const std::size_t scalar = scalarBytes(stored_.type);
    std::vector<std::uint8_t> slab(std::min(values.size(), kSlabScalars) * scalar);
    for (std::span<float> rest(values); !rest.empty();) {
      const std::size_t count = std::min(rest.size(), kSlabScalars);
      ISOREEL_TRY(readBytes(std::span(slab).first(count * scalar)));
      convertScalars(stored_.type, stored_.order, slab.data(), rest.first(count), stored_.rescale);
      rest = rest.subspan(count);
    }
    return Volume::own(stored_.grid, std::move(values));
  }

  Status readBytes(std::span<std::uint8_t> out) {
    while (!out.empty()) {
      const std::uint64_t within = position_ % partBytes_;
      if (!stream_) {
        const StoredVolumes::Part& part = stored_.parts[position_ / partBytes_];
        const bool plain = stored_.coding == Coding::kPlain;
        ISOREEL_ASSIGN(stream_, ByteStream::open(part.path, part.offset + (plain ? stored_.skip + within : 0),
                                                 stored_.coding));
        if (!plain) ISOREEL_TRY(stream_->skip(stored_.skip + within));
      }
      const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(out.size(), partBytes_ - within));
      ISOREEL_TRY(stream_->read(out.first(count)));
      out = out.subspan(count);
      position_ += count;
      if (position_ % partBytes_ == 0) {
        ISOREEL_TRY(stream_->expectEnd());
        stream_.reset();
      }
    }
    return {};
  }

  struct Waiting {
    std::uint64_t position;
    std::unique_ptr<ByteStream> stream;
  };

  StoredVolumes stored_;
  std::uint64_t partBytes_ = 1;
  std::vector<Waiting> waiting_;        // where reads ended inside a part, the oldest first
  std::unique_ptr<ByteStream> stream_;  // of the part that position_ lies in, at it; null before a part
  std::uint64_t position_ = 0;          // among the bytes of all samples
};

}  // namespace

std::optional<double> StoredVolumes::time(std::size_t i) const {
  if (!firstTime) return std::nullopt;
  return *firstTime + timeStep * static_cast<double>(i);
}

std::string StoredVolumes::name(std::size_t i) const {
  if (parts.size() == volumes) return parts[i].path;
  return volumes == 1 ? header : fmt::format("{} (volume {})", header, i);
}

SequenceResult openStored(StoredVolumes stored) {
  if (Status status = checkGrid(stored.grid).at(stored.header); !status.ok()) return status;
  auto sequence = std::make_unique<StoredSequence>(std::move(stored));
  ISOREEL_TRY(sequence->check());
  return std::unique_ptr<VolumeSequence>(std::move(sequence));
}

}  // namespace isoreel::io
