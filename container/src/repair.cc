// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/container/reader.h>
#include <isoreel/container/repair.h>

#include <algorithm>

#include "src/open.h"
#include "src/scan.h"

namespace isoreel {

using namespace container;

namespace {

/// Entries of a track that decode one after another.
struct Gop {
  const TrackContents* track;
  std::vector<const FrameEntry*> entries;
};

class Repair {
 public:
  Repair(const std::filesystem::path& from, const std::filesystem::path& to, RepairOptions options)
      : from_(from), to_(to), options_(std::move(options)) {}

  Result<RepairReport> run() {
    {
      ISOREEL_ASSIGN(const auto source, openFile(from_));
      ISOREEL_ASSIGN(ParityReport parity, checkParity(*source));
      report_.restored_blocks = parity.restored;
      report_.parity = std::move(parity.lines);
      patches_ = std::move(parity.patches);
      Contents contents;
      const Status scan = scanChunks(*source, *source->size(), contents);
      report_.damage = std::move(contents.info.damage);
      if (!scan.ok()) report_.damage.push_back(scan.error().message);
    }
    const Result<std::uint64_t> frames = playThrough();
    if (frames.ok() && !options_.compact) {
      report_.exact = true;
      report_.frames = *frames;
      ISOREEL_TRY(copy());
      return std::move(report_);
    }
    if (report_.damage.empty() && !frames.ok()) report_.damage.push_back(frames.error().message);
    ISOREEL_TRY(rewrite());
    return std::move(report_);
  }

 private:
  Result<std::unique_ptr<ByteSource>> source() const {
    ISOREEL_ASSIGN(auto file, openFile(from_));
    return patchedSource(std::move(file), patches_);
  }

  // The frames of all tracks, if everything is as it should be.
  Result<std::uint64_t> playThrough() const {
    ISOREEL_ASSIGN(auto bytes, source());
    ISOREEL_ASSIGN(const auto stream, StreamReader::open(std::move(bytes)));
    for (;;) {
      ISOREEL_ASSIGN(const std::optional<Packet> packet, stream->next());
      if (!packet) break;
    }
    std::uint64_t frames = 0;
    for (const TrackInfo& track : stream->info().tracks) frames += track.frames;
    // What plays may have an index that is of no use.
    ISOREEL_ASSIGN(auto again, source());
    ISOREEL_ASSIGN(const auto reader, Reader::open(std::move(again)));
    if (reader->info().indexed) return frames;
    return {ErrorCode::kBadData, "the seek index is damaged"};
  }

  Status copy() {
    ISOREEL_ASSIGN(const auto bytes, source());
    ISOREEL_ASSIGN(const auto sink, createFile(to_, options_.overwrite));
    return copyAll(*bytes, *sink);
  }

  // Sorts the entries of a track into GOPs as far as they are whole, and notes what is lost.
  void plan(ByteSource& bytes, const TrackContents& track) {
    std::uint64_t due_position = 0, due_number = 0;
    bool broken = false;  // the GOP that is being walked
    Gop gop{&track, {}};
    const auto close = [&] {
      // Hidden packets at its end are needed by nothing that is left.
      while (!gop.entries.empty() && gop.entries.back()->header.hidden()) gop.entries.pop_back();
      if (!gop.entries.empty()) gops_.push_back(gop);
      gop.entries.clear();
    };
    for (const FrameEntry& entry : track.entries) {
      const FrameHeader& header = entry.header;
      if (header.position != due_position) {
        broken = true;
        if (header.number > due_number) note(report_.lost, track, due_number, header.number - 1);
      }
      due_position = header.position + 1;
      due_number = header.number + (header.hidden() ? 0 : 1);
      if (header.back == 0) {
        close();
        broken = false;
      }
      if (!readPacket(bytes, track.record.id, entry).ok()) {
        broken = true;
        if (!header.hidden()) note(report_.lost, track, header.number, header.number);
      } else if (!broken) {
        gop.entries.push_back(&entry);
      } else if (!header.hidden()) {
        note(report_.dependent, track, header.number, header.number);
      }
    }
    close();
  }

  static void note(std::vector<FrameRun>& runs, const TrackContents& track, std::uint64_t first,
                   std::uint64_t last) {
    if (!runs.empty() && runs.back().track == track.record.id && runs.back().last + 1 == first) {
      runs.back().last = last;
    } else {
      runs.push_back({track.record.id, first, last});
    }
  }

  Status rewrite() {
    ISOREEL_ASSIGN(const auto bytes, source());
    Contents contents;
    ISOREEL_TRY(openContents(*bytes, contents));
    ISOREEL_ASSIGN(auto more, source());
    ISOREEL_ASSIGN(const auto reader, Reader::open(std::move(more)));  // for attachments
    for (const TrackContents& track : contents.tracks) {
      plan(*bytes, track);
      if (!contents.info.indexed) report_.open_ended.push_back(track.record.id);
    }
    std::sort(gops_.begin(), gops_.end(), [](const Gop& a, const Gop& b) {
      return a.entries.front()->offset < b.entries.front()->offset;
    });
    ISOREEL_ASSIGN(auto sink, createFile(to_, options_.overwrite));
    WriterSettings settings;
    const TrackRecord& first = contents.tracks.front().record;
    settings.time_base = first.time_base;
    settings.track_name = first.name;
    settings.configuration = first.configuration;
    settings.tags = contents.info.tags;
    settings.options = options_.writer;
    ISOREEL_ASSIGN(const auto writer, Writer::create(std::move(sink), std::move(settings)));
    Status status = fill(*writer, *bytes, contents, *reader);
    if (status.ok()) status = writer->finish();
    if (!status.ok()) writer->discard();
    return status;
  }

  Status fill(Writer& writer, ByteSource& bytes, const Contents& contents, Reader& reader) {
    std::vector<std::uint64_t> ids(contents.tracks.size(), 0), next(contents.tracks.size(), 0);
    for (std::size_t i = 1; i < contents.tracks.size(); ++i) {
      const TrackRecord& record = contents.tracks[i].record;
      // A track whose record is lost has no name, as others may.
      const bool taken =
          std::any_of(contents.tracks.begin(), contents.tracks.begin() + static_cast<std::ptrdiff_t>(i),
                      [&](const TrackContents& t) { return t.record.name == record.name; });
      const std::string name = taken ? "track " + std::to_string(record.id) : record.name;
      ISOREEL_ASSIGN(ids[i], writer.addTrack({record.time_base, name, record.configuration}));
    }
    ISOREEL_TRY(writer.setChapters(contents.info.chapters));
    for (const Gop& gop : gops_) {
      const std::size_t track = static_cast<std::size_t>(gop.track - contents.tracks.data());
      for (const FrameEntry* entry : gop.entries) {
        Packet packet{entry->header, {}};
        ISOREEL_ASSIGN(packet.data, readPacket(bytes, gop.track->record.id, *entry));
        packet.header.number = next[track];
        ISOREEL_TRY(writer.write(packet, ids[track]));
        if (entry->header.hidden()) continue;
        ++report_.frames;
        if (entry->header.number != next[track]) noteNumber(*gop.track, entry->header.number, next[track]);
        ++next[track];
      }
      ISOREEL_TRY(writer.endGop());
    }
    for (const Attachment& attachment : contents.info.attachments)
      ISOREEL_TRY(attach(writer, reader, attachment));
    return {};
  }

  void noteNumber(const TrackContents& track, std::uint64_t old_number, std::uint64_t number) {
    const std::size_t runs = report_.renumbered.size();
    note(report_.renumbered, track, old_number, old_number);
    if (report_.renumbered.size() > runs) report_.numbers.push_back(number);
  }

  Status attach(Writer& writer, Reader& reader, const Attachment& attachment) {
    ISOREEL_ASSIGN(const auto content, reader.openAttachment(attachment.name));
    // Read twice, since half an attachment is none.
    Bytes buffer(std::size_t{1} << 20);
    for (std::uint64_t offset = 0; offset < attachment.bytes;) {
      const Result<std::size_t> got = content->read(offset, buffer);
      if (!got.ok() || *got == 0) {
        report_.attachments.push_back(attachment.name);
        return {};
      }
      offset += *got;
    }
    return writer.attach(attachment.name, attachment.media_type, *content);
  }

  const std::filesystem::path from_, to_;
  const RepairOptions options_;
  std::map<std::uint64_t, Bytes> patches_;
  std::vector<Gop> gops_;
  RepairReport report_;
};

}  // namespace

Result<RepairReport> repairFile(const std::filesystem::path& from, const std::filesystem::path& to,
                                RepairOptions options) {
  return withoutThrowing([&] { return Repair(from, to, std::move(options)).run(); });
}

}  // namespace isoreel
