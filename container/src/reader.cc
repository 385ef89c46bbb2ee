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

  const TrackContents& track() const { return contents.tracks[chosen]; }
};

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
  return withoutThrowing([&] { return readPacket(source, state_->track().record.id, frame); })
      .at(source.name() + ": " + framePlace(frame.header, frame.offset));
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
