// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/codec/decoder.h>
#include <isoreel/container/reader.h>
#include <isoreel/io/mesh_writer.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "command.h"
#include "decoding.h"
#include "frame_range.h"
#include "gop.h"
#include "input.h"
#include "options.h"
#include "output.h"
#include "parallel.h"
#include "progress.h"

namespace isoreel::cli {
namespace {

struct DecodeCommandOptions {
  std::string input;
  std::string track;
  bool follow = false;
  std::string output;
  std::string frames;
  std::optional<int> level;
  bool normals = false;
  bool discard = false;
  bool json = false;
  bool force = false;
  int jobs = 0;
};

/// Packets of the chosen frames in order, and before them those that the first needs: by the index from a
/// file, forward from a pipe.
class ChosenFrames {
 public:
  static Result<ChosenFrames> open(const DecodeCommandOptions& options) {
    ChosenFrames result;
    ISOREEL_ASSIGN(std::unique_ptr<ByteSource> source,
                   options.follow ? followFile(options.input, [] { return interrupted.load(); })
                                  : openBytes(options.input));
    lavf::Sniffed bytes;
    if (options.follow) {
      bytes.source = std::move(source);
    } else {
      ISOREEL_ASSIGN(bytes, lavf::sniff(std::move(source)));
    }
    ISOREEL_ASSIGN(ForwardInput forward, openForward(std::move(bytes), options.track));
    result.reader_ = std::move(forward.input.packets);
    result.stream_ = std::move(forward.stream);
    if (result.reader_) {
      result.info_ = std::move(forward.input.info);
      warnOfDamage(result.info_, options.input);
      result.range_ = parseFrames(options.frames, timelineOf(*result.reader_, result.info_.time_base));
      result.total_ = result.range_.size();
      if (result.range_.size() > 0) {
        const PacketSource& reader = *result.reader_;
        const std::uint64_t first = reader.entryOf(result.range_.begin);
        const Result<std::uint64_t> key = keyEntry(reader, result.range_.begin);
        result.next_ = key.ok() ? *key : first;  // the decoder says what is missing
        result.end_ = reader.entryOf(result.range_.end - 1) + 1;
        result.reader_->willRead(result.next_, result.end_);
        result.first_number_ = reader.header(result.range_.begin).number;
      }
    } else {
      result.range_ = parseFrames(options.frames, {.count = kUnknownEnd, .base = {}, .time = {}});
      result.first_number_ = result.range_.begin;
      if (result.range_.end != kUnknownEnd) result.total_ = result.range_.size();
    }
    return result;
  }
  std::optional<std::uint64_t> total() const { return total_; }
  TimeBase timeBase() const { return (reader_ ? info_ : stream_->info()).time_base; }
  /// Fails when a mesh that is known to come must not be written. Of a pipe, none is known.
  Status mayWriteAll(const std::string& output, bool force) const {
    for (std::uint64_t i = range_.begin; reader_ && i < range_.end; ++i)
      ISOREEL_TRY(mayWrite(frameName(output, reader_->header(i).number), force));
    return {};
  }

  /// Whether a frame is one of the chosen, and not only needed by them.
  bool chosen(const FrameHeader& header) const { return !header.hidden() && header.number >= first_number_; }

  /// False when there are no more.
  Result<bool> next(Packet& packet) {
    if (reader_) {
      if (next_ >= end_) return false;
      packet.header = reader_->entryHeader(next_);
      ISOREEL_ASSIGN(packet.data, reader_->entryPacket(next_++));
      return true;
    }
    for (;;) {
      if (next_ >= range_.end) return false;
      ISOREEL_ASSIGN(std::optional<Packet> read, stream_->next());
      if (!read && (range_.end != kUnknownEnd || (range_.begin > 0 && next_ <= range_.begin))) {
        return {ErrorCode::kNotFound,
                fmt::format("standard input: ends after {}, before those that --frames asks for",
                            counted(next_, "frame"))};
      }
      if (!read) return false;
      if (!read->header.hidden()) ++next_;
      packet = *std::move(read);
      return true;
    }
  }

 private:
  static constexpr std::uint64_t kUnknownEnd = std::numeric_limits<std::uint64_t>::max();  // of a pipe

  std::unique_ptr<PacketSource> reader_;
  FileInfo info_;  // of what `reader_` reads
  std::unique_ptr<StreamReader> stream_;
  FrameRange range_;
  std::uint64_t next_ = 0, end_ = 0;  // of a file, entries; of a pipe, frames that came
  std::uint64_t first_number_ = 0;    // of those chosen
  std::optional<std::uint64_t> total_;
};

/// `key`: the packet that the GOP starts with, which knows the octree's depth.
DecodeOptions codecOptions(const DecodeCommandOptions& options, ByteSpan key) {
  DecodeOptions result = decodeOptions();
  if (!options.level) return result;
  if (*options.level >= 0) {
    result.level = static_cast<std::uint32_t>(*options.level);
    return result;
  }
  // Counted from the finest. A damaged head is left for the decoder to name.
  std::uint32_t deepest = 0;
  if (const Result<PacketHeader> header = readPacketHeader(key); header.ok()) {
    if (const Result<Configuration> c = readConfiguration(header->configuration); c.ok())
      deepest = octreeDepth(c->grid);
  }
  const std::uint32_t coarser = static_cast<std::uint32_t>(-std::int64_t{*options.level});
  result.level = deepest > coarser ? deepest - coarser : 0;
  return result;
}

struct DecodeItem {
  struct Written {
    FrameHeader header;
    std::filesystem::path path;
    std::size_t vertices = 0, faces = 0;
  };
  Gop gop;
  std::vector<Written> written;
};

std::string extensionOf(const std::string& output) {
  return CLI::detail::to_lower(std::filesystem::path(output).extension().string());
}

/// Before anything is decoded. "" passes.
void checkExtension(const std::string& output) {
  const std::string extension = extensionOf(output);
  const std::vector<std::string> known = io::meshExtensions();
  if (output.empty() || std::find(known.begin(), known.end(), extension) != known.end()) return;
  throw CLI::ValidationError("--output",
                             fmt::format("'{}' ends in none of {}", output, fmt::join(known, " ")));
}

/// ParaView's index of a series of .vtp files: the output's name up to its number ("out/splash_%05d.vtp"
/// gives "out/splash.pvd"), or "frames.pvd" when nothing stands before it; nothing for other outputs.
std::optional<std::filesystem::path> seriesIndex(const std::string& output) {
  if (extensionOf(output) != ".vtp" || !countsFrames(output)) return std::nullopt;
  const std::filesystem::path start = output.substr(0, output.find('%'));
  std::string name = start.filename().string();
  name.erase(name.find_last_not_of("_-. ") + 1);
  return start.parent_path() / ((name.empty() ? "frames" : name) + ".pvd");
}

Status decode(const DecodeCommandOptions& options) {
  const Stopwatch watch;
  if (options.discard != options.output.empty()) {
    throw CLI::ValidationError(
        "--output", options.discard ? "and --discard exclude each other" : "is required, or --discard");
  }
  checkExtension(options.output);
  Result<ChosenFrames> frames = ChosenFrames::open(options);
  if (!frames) return frames.status();
  if (!options.discard && frames->total() != std::uint64_t{1} && !countsFrames(options.output)) {
    throw CLI::ValidationError(
        "--output",
        fmt::format("'{}' must count frames (out_%05d.ply), or --frames choose one", options.output));
  }
  const std::optional<std::filesystem::path> index = seriesIndex(options.output);
  if (index) ISOREEL_TRY(mayWrite(*index, options.force));
  if (!options.discard) ISOREEL_TRY(frames->mayWriteAll(options.output, options.force));
  const ThreadLimit limit(options.jobs);
  Progress progress("decode", frames->total());
  tbb::enumerable_thread_specific<Decoder> decoders{Decoder(parallelWithin)};
  std::uint64_t count = 0, vertices = 0, faces = 0;
  std::vector<io::SeriesFrame> series;
  const auto secondsOf = [base = frames->timeBase()](const FrameHeader& header) {
    return base.seconds(header.time);
  };
  const auto work = [&](DecodeItem& item) -> Status {
    for (const Packet& packet : item.gop.packets) {
      if (interrupted) return {};
      const FrameHeader& header = packet.header;
      Result<Surface> surface =
          decoders.local().decode(packet.data, codecOptions(options, item.gop.packets.front().data));
      if (!surface) return surface.status().at(fmt::format("{}: frame {}", options.input, header.number));
      if (!frames->chosen(header)) continue;
      DecodeItem::Written written{header, {}, surface->vertices.size(), surface->quads.size()};
      if (!options.discard) {
        written.path = frameName(options.output, header.number);
        std::error_code ignored;
        ISOREEL_TRY(mayWrite(written.path, options.force));
        if (written.path.has_parent_path())
          std::filesystem::create_directories(written.path.parent_path(), ignored);
        ISOREEL_TRY(io::writeMesh(*surface, written.path,
                                  {.normals = options.normals, .seconds = secondsOf(header)}));
      }
      item.written.push_back(std::move(written));
    }
    return {};
  };
  GopSource gops([&](Packet& packet) { return frames->next(packet); });
  ISOREEL_TRY(forEachFrame<DecodeItem>(
      options.jobs, [&](DecodeItem& item) { return gops.next(item.gop); }, work,
      [&](DecodeItem& item) -> Status {
        for (const DecodeItem::Written& written : item.written) {
          ++count;
          vertices += written.vertices;
          faces += written.faces;
          if (index) series.push_back({secondsOf(written.header), written.path});
          progress.advance();
        }
        return {};
      }));
  progress.clear();
  if (interrupted) return {ErrorCode::kIo, fmt::format("interrupted after {}", counted(count, "frame"))};
  if (index) ISOREEL_TRY(io::writeSeries(series, *index));
  if (options.json) {
    fmt::print("{}\n",
               nlohmann::ordered_json{
                   {"frames", count}, {"vertices", vertices}, {"faces", faces}, {"seconds", watch.seconds()}}
                   .dump());
  } else {
    fmt::print("{}: {}, {} vertices, {} quads in {:.2f} s\n", options.input, counted(count, "frame"),
               vertices, faces, watch.seconds());
  }
  return {};
}

}  // namespace

void addDecodeCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand("decode", "Write the surfaces of an .isr file as meshes");
  const auto options = std::make_shared<DecodeCommandOptions>();
  verb->add_option("input", options->input, kInputHelp)->required();
  verb->add_option(
      "-o,--output", options->output,
      fmt::format("Mesh file, by its extension ({}); %05d counts frames: out/%05d.ply. A series of "
                  ".vtp gets an index with its times for ParaView: out/splash_%05d.vtp makes "
                  "out/splash.pvd, out/%05d.vtp out/frames.pvd",
                  fmt::join(io::meshExtensions(), " ")));
  verb->add_option("--frames", options->frames, kFramesHelp);
  verb->add_option(
      "--level", options->level,
      "Coarser surface: octree level from the root (0), or from the finest (-1: cells twice as large)");
  verb->add_flag("--normals", options->normals,
                 "Write a normal for each vertex (.stl has one for each facet anyway)");
  verb->add_flag("--discard", options->discard, "Decode and write nothing, for timing");
  verb->add_option("--jobs", options->jobs, "Threads, and frames under way at once; 0: one a core")
      ->check(CLI::Range(0, 256));
  verb->add_flag("--force", options->force, "Replace meshes that are there already");
  verb->add_flag("--json", options->json, "End with the totals as one JSON object");
  verb->add_flag("--follow", options->follow,
                 "Go on while the file is being written, GOP by GOP, until its writer finishes");
  addTrackOption(*verb, options->track);
  verb->callback([options, &chosen] { chosen = [options] { return decode(*options); }; });
}

}  // namespace isoreel::cli
