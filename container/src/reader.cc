// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/container/reader.h>

#include <algorithm>

#include "src/chunk.h"
#include "src/contents.h"
#include "src/open.h"
#include "src/scan.h"

namespace isoreel {
namespace {

using namespace container;

constexpr std::uint64_t kMostAhead = std::uint64_t{1} << 24;  // bytes that are fetched together

// An attachment's content, front to back. Other chunks may stand between its parts: parity, for one.
class AttachmentSource final : public ByteSource {
 public:
  AttachmentSource(ByteSource& file, Attachment attachment)
      : file_(file), attachment_(std::move(attachment)) {}

  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    if (offset < start_) rewind();
    std::size_t done = 0;
    while (done < out.size() && offset + done < attachment_.bytes) {
      const std::uint64_t inside = offset + done - start_;
      if (inside >= part_.size()) {
        if (Status status = withoutThrowing([&] { return nextPart(); }); !status.ok())
          return status.at(name());
        continue;
      }
      const std::size_t count =
          std::min<std::size_t>(out.size() - done, part_.size() - static_cast<std::size_t>(inside));
      std::copy_n(part_.begin() + static_cast<std::ptrdiff_t>(inside), count,
                  out.begin() + static_cast<std::ptrdiff_t>(done));
      done += count;
    }
    return done;
  }
  std::optional<std::uint64_t> size() const override { return attachment_.bytes; }
  std::string name() const override { return file_.name() + ": attachment '" + attachment_.name + "'"; }

 private:
  void rewind() {
    start_ = walked_ = next_ = 0;
    part_.clear();
  }

  Status nextPart() {
    start_ += part_.size();
    part_.clear();
    while (walked_ < attachment_.length) {
      const std::uint64_t offset = attachment_.offset + walked_;
      const std::string place = "byte " + std::to_string(offset);
      ISOREEL_ASSIGN(const Bytes front, readExactly(file_, offset, ChunkHeader::kBytes).at(place));
      ISOREEL_ASSIGN(const ChunkHeader header, readChunkHeader(front).at(place));
      if (header.length > attachment_.length - walked_) break;
      const std::uint64_t whole = header.length + kChunkOverhead;
      walked_ += whole;
      if (header.type != kAttachmentType) continue;
      ISOREEL_TRY(checkPayloadLength(header).at(place));
      ISOREEL_ASSIGN(const Bytes chunk, readExactly(file_, offset, whole).at(place));
      ISOREEL_ASSIGN(const ByteSpan payload, readChunk(chunk, kAttachmentType).at(place));
      ISOREEL_ASSIGN(PartFacts facts, readPart(payload).at(place));
      if (facts.part.name != attachment_.name || facts.part.part != next_ || facts.content.empty()) break;
      part_ = std::move(facts.content);
      ++next_;
      return {};
    }
    return {ErrorCode::kBadData, "its parts are not those that are listed (spec container 7.3)"};
  }

  ByteSource& file_;
  const Attachment attachment_;
  std::uint64_t start_ = 0;   // of part_ in the content
  std::uint64_t walked_ = 0;  // bytes of chunks behind attachment_.offset
  std::uint64_t next_ = 0;    // part
  Bytes part_;
};

}  // namespace

struct Reader::State {
  std::unique_ptr<ByteSource> source;
  Contents contents;
  std::size_t chosen = 0;

  // Entries that are going to be asked for, and what was fetched of the file for them.
  std::uint64_t ahead_begin = 0, ahead_end = 0;
  Bytes run;
  std::uint64_t run_offset = 0;

  const TrackContents& track() const { return contents.tracks[chosen]; }
  std::uint64_t runEnd(std::uint64_t entry) const;
  Result<Bytes> chunk(std::uint64_t entry);
};

// The end of the last chunk that is worth fetching with that of `entry`: announced, and with more of what is
// asked for than of other things in between.
std::uint64_t Reader::State::runEnd(std::uint64_t entry) const {
  const std::vector<FrameEntry>& entries = track().entries;
  const FrameEntry& first = entries[static_cast<std::size_t>(entry)];
  std::uint64_t end = first.offset + first.bytes, wanted = first.bytes;
  if (entry < ahead_begin) return end;
  for (++entry; entry < std::min<std::uint64_t>(ahead_end, entries.size()); ++entry) {
    const FrameEntry& next = entries[static_cast<std::size_t>(entry)];
    wanted += next.bytes;
    const std::uint64_t span = next.offset + next.bytes - first.offset;
    if (span > kMostAhead || span / 2 > wanted) break;
    end = next.offset + next.bytes;
  }
  return end;
}

Result<Bytes> Reader::State::chunk(std::uint64_t entry) {
  const FrameEntry& frame = track().entries[static_cast<std::size_t>(entry)];
  const auto held = [&] {
    return frame.offset >= run_offset && frame.offset - run_offset <= run.size() &&
           frame.bytes <= run.size() - (frame.offset - run_offset);
  };
  if (!held()) {
    const std::uint64_t end = runEnd(entry);
    run = {};
    if (end == frame.offset + frame.bytes) return readExactly(*source, frame.offset, frame.bytes);
    Result<Bytes> fetched = readExactly(*source, frame.offset, end - frame.offset);
    if (!fetched)
      return readExactly(*source, frame.offset, frame.bytes);  // the file may have been cut further on
    run = *std::move(fetched);
    run_offset = frame.offset;
  }
  const auto start = run.begin() + static_cast<std::ptrdiff_t>(frame.offset - run_offset);
  Bytes result(start, start + static_cast<std::ptrdiff_t>(frame.bytes));
  if (start + static_cast<std::ptrdiff_t>(frame.bytes) == run.end()) run = {};
  return result;
}

Reader::Reader(std::unique_ptr<State> state) : state_(std::move(state)) {}
Reader::~Reader() = default;

Result<std::unique_ptr<Reader>> Reader::open(const std::filesystem::path& path, const std::string& track) {
  ISOREEL_ASSIGN(auto source, openFile(path));
  return open(std::move(source), track);
}

Result<std::unique_ptr<Reader>> Reader::open(std::unique_ptr<ByteSource> source, const std::string& track) {
  auto state = std::make_unique<State>();
  state->source = std::move(source);
  ByteSource& bytes = *state->source;
  const auto opened = [&]() -> Status {
    ISOREEL_TRY(openContents(bytes, state->contents));
    ISOREEL_ASSIGN(state->chosen, state->contents.choose(track));
    return {};
  };
  const Status status = withoutThrowing(opened).at(bytes.name());
  if (!status.ok()) return status;
  return std::unique_ptr<Reader>(new Reader(std::move(state)));
}

Result<FileInfo> scanFile(ByteSource& source) {
  if (!source.seekable() || !source.size())
    return {ErrorCode::kInvalidArgument, source.name() + ": a pipe cannot be scanned"};
  const auto scan = [&]() -> Result<FileInfo> {
    Contents contents;
    contents.info.bytes = *source.size();
    ISOREEL_TRY(scanChunks(source, *source.size(), contents));
    ISOREEL_ASSIGN(std::ignore, contents.choose(""));
    return std::move(contents.info);
  };
  return withoutThrowing(scan).at(source.name());
}

const FileInfo& Reader::info() const { return state_->contents.info; }
std::uint64_t Reader::frameCount() const { return state_->track().shown.size(); }
std::uint64_t Reader::entryCount() const { return state_->track().entries.size(); }
std::uint64_t Reader::entryOf(std::uint64_t frame) const {
  return state_->track().shown[static_cast<std::size_t>(frame)];
}
const FrameHeader& Reader::header(std::uint64_t frame) const { return entryHeader(entryOf(frame)); }
const FrameHeader& Reader::entryHeader(std::uint64_t entry) const {
  return state_->track().entries[static_cast<std::size_t>(entry)].header;
}
std::uint64_t Reader::chunkOffset(std::uint64_t entry) const {
  return state_->track().entries[static_cast<std::size_t>(entry)].offset;
}
std::uint64_t Reader::chunkBytes(std::uint64_t entry) const {
  return state_->track().entries[static_cast<std::size_t>(entry)].bytes;
}

std::uint64_t Reader::entryBytes(std::uint64_t entry) const {
  const FrameEntry& frame = state_->track().entries[static_cast<std::size_t>(entry)];
  Bytes start;  // with a packet length of one byte
  if (!appendFrameStart(start, state_->track().record.id, frame.header, 1).ok()) return 0;
  const std::uint64_t rest = frame.bytes - std::min(frame.bytes, kChunkOverhead + start.size() - 1);
  for (std::uint64_t length = 1; length <= 5 && length < rest; ++length) {
    if ((rest - length) >> (7 * length) == 0) return rest - length;
  }
  return 0;
}
void Reader::willRead(std::uint64_t begin, std::uint64_t end) {
  state_->ahead_begin = begin;
  state_->ahead_end = end;
}

Result<Bytes> Reader::packet(std::uint64_t frame) {
  if (frame < frameCount()) return entryPacket(entryOf(frame));
  return {ErrorCode::kNotFound, state_->source->name() + ": there is no frame at position " +
                                    std::to_string(frame) + "; the file has " + std::to_string(frameCount())};
}

Result<Bytes> Reader::entryPacket(std::uint64_t entry) {
  ByteSource& source = *state_->source;
  if (entry >= entryCount()) {
    return {ErrorCode::kNotFound,
            source.name() + ": there is no packet at position " + std::to_string(entry)};
  }
  const FrameEntry& frame = state_->track().entries[static_cast<std::size_t>(entry)];
  const auto read = [&]() -> Result<Bytes> {
    ISOREEL_ASSIGN(Bytes chunk, state_->chunk(entry));
    return packetOf(std::move(chunk), state_->track().record.id, frame);
  };
  return withoutThrowing(read).at(source.name() + ": " + framePlace(frame.header, frame.offset));
}

Result<std::unique_ptr<ByteSource>> Reader::openAttachment(const std::string& name) {
  ByteSource& source = *state_->source;
  for (const Attachment& attachment : info().attachments) {
    if (attachment.name == name)
      return std::unique_ptr<ByteSource>(std::make_unique<AttachmentSource>(source, attachment));
  }
  return {ErrorCode::kNotFound, source.name() + ": there is no attachment '" + name + "'"};
}

}  // namespace isoreel
