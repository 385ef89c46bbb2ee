// SPDX-License-Identifier: BSD-3-Clause
#include "input.h"

#include <fmt/format.h>
#include <isoreel/codec/packet_header.h>
#include <isoreel/lavf/carrier_reader.h>
#include <isoreel/lavf/url.h>

extern "C" {
#include <libavutil/mem.h>
}

#include <climits>

#include "interrupt.h"
#include "output.h"

namespace isoreel::cli {
namespace {

class PacketsInMemory final : public PacketSource {
 public:
  explicit PacketsInMemory(std::vector<Packet> packets) : packets_(std::move(packets)) {
    for (std::uint64_t i = 0; i < packets_.size(); ++i) {
      if (!packets_[i].header.hidden()) shown_.push_back(i);
    }
  }
  std::uint64_t frameCount() const override { return shown_.size(); }
  const FrameHeader& header(std::uint64_t frame) const override { return packets_[shown_[frame]].header; }
  Result<Bytes> packet(std::uint64_t frame) override { return packets_[shown_[frame]].data; }
  std::uint64_t entryCount() const override { return packets_.size(); }
  std::uint64_t entryOf(std::uint64_t frame) const override { return shown_[frame]; }
  const FrameHeader& entryHeader(std::uint64_t entry) const override { return packets_[entry].header; }
  Result<Bytes> entryPacket(std::uint64_t entry) override { return packets_[entry].data; }
  std::uint64_t entryBytes(std::uint64_t entry) const override { return packets_[entry].data.size(); }

 private:
  std::vector<Packet> packets_;
  std::vector<std::uint64_t> shown_;
};

/// While one of these lives, libavformat takes no piece of memory out of proportion to the file. It believes
/// what tables claim: an index of 2 GB for a file of 2 kB. 8 bytes for each of the file's are more than any
/// table in it can need (4 bytes for a sample there, 24 in the index), and its probes and buffers find room
/// in 8 MiB. A pipe's index gets 256 MiB: 10 million frames. The setting is the process's, so this is for the
/// command, which opens one file after the other.
class Proportion {
 public:
  explicit Proportion(const ByteSource& source) {
    const std::optional<std::uint64_t> size = source.size();
    const std::uint64_t likely = size ? std::min<std::uint64_t>(*size, INT_MAX) : 31 << 20;  // of a pipe
    const std::uint64_t most = (likely + (1 << 20)) * 8;
    av_max_alloc(static_cast<std::size_t>(std::min<std::uint64_t>(most, INT_MAX)));
  }
  Proportion(const Proportion&) = delete;
  Proportion& operator=(const Proportion&) = delete;
  ~Proportion() { av_max_alloc(INT_MAX); }  // as it was
};

/// The rest of a stream, kept.
Status keepAll(StreamReader& stream, Input& input) {
  std::vector<Packet> packets;
  std::vector<std::string> damage;
  for (;;) {
    Result<std::optional<Packet>> packet = stream.next();
    if (!packet) {  // cut: as from a file, the whole frames are there and the loss is told
      if (packet.error().code != ErrorCode::kTruncated) return packet.status();
      damage.emplace_back(packet.error().message);
      break;
    }
    if (!*packet) break;
    packets.push_back(**std::move(packet));
  }
  input.info = stream.info();
  input.info.damage.insert(input.info.damage.end(), damage.begin(), damage.end());
  input.packets = std::make_unique<PacketsInMemory>(std::move(packets));
  return {};
}

}  // namespace

void addTrackOption(CLI::App& verb, std::string& track) {
  verb.add_option("--track", track,
                  "Name or number of the track to read, where the file has several (default: the first)")
      ->default_str("");
}

Result<std::unique_ptr<ByteSource>> openBytes(const std::string& path) {
  if (!lavf::isUrl(path)) return openFile(path);
  return lavf::openUrl(path, [] { return interrupted.load(); });
}

Result<ForwardInput> openForward(lavf::Sniffed bytes, const std::string& track) {
  ForwardInput result;
  Input& input = result.input;
  if (bytes.carrier) {
    const Proportion bounded(*bytes.source);
    ISOREEL_ASSIGN(auto reader, lavf::CarrierReader::open(std::move(bytes.source), track));
    input.info = reader->info();
    input.carrier = reader->carrier();
    input.openAttachment = [from = reader.get()](const std::string& name) {
      return from->openAttachment(name);
    };
    input.packets = std::move(reader);
  } else if (bytes.source->seekable()) {
    ISOREEL_ASSIGN(std::unique_ptr<Reader> reader, Reader::open(std::move(bytes.source), track));
    input.info = reader->info();
    input.openAttachment = [from = reader.get()](const std::string& name) {
      return from->openAttachment(name);
    };
    input.offsetOf = [from = reader.get()](std::uint64_t entry) { return from->chunkOffset(entry); };
    input.packets = std::move(reader);
  } else {
    ISOREEL_ASSIGN(result.stream, StreamReader::open(std::move(bytes.source), track));
  }
  return result;
}

Result<Input> openInput(lavf::Sniffed bytes, const std::string& track) {
  ISOREEL_ASSIGN(ForwardInput forward, openForward(std::move(bytes), track));
  Input& input = forward.input;
  if (forward.stream) ISOREEL_TRY(keepAll(*forward.stream, input));
  Bytes record = input.info.configuration;
  if (record.empty() &&
      input.packets->frameCount() > 0) {  // the track record is lost: every I packet repeats it
    ISOREEL_ASSIGN(const Bytes packet, input.packets->packet(0));
    ISOREEL_ASSIGN(const PacketHeader header, readPacketHeader(packet));
    record = header.configuration;
  }
  ISOREEL_ASSIGN(input.configuration, readConfiguration(record));
  if (input.info.configuration.empty()) input.info.time_base = input.configuration.time_base;
  return std::move(input);
}

Result<lavf::Sniffed> openSniffed(const std::string& path) {
  ISOREEL_ASSIGN(auto source, openBytes(path));
  return lavf::sniff(std::move(source));
}

Result<Input> openInput(const std::string& path, const std::string& track) {
  const auto open = [&]() -> Result<Input> {
    ISOREEL_ASSIGN(lavf::Sniffed bytes, openSniffed(path));
    return openInput(std::move(bytes), track);
  };
  Result<Input> input = open();
  if (!input) return named(input.status(), path);
  return input;
}

Result<Input> openFacts(const std::string& path) {
  const auto open = [&]() -> Result<Input> {
    ISOREEL_ASSIGN(lavf::Sniffed bytes, openSniffed(path));
    ISOREEL_ASSIGN(ForwardInput forward, openForward(std::move(bytes), ""));
    if (!forward.stream) return std::move(forward.input);
    return {ErrorCode::kInvalidArgument, "cannot be had from a pipe: these bytes must be read twice"};
  };
  Result<Input> input = open();
  if (!input) return named(input.status(), path);
  return input;
}

void warnOfDamage(const FileInfo& info, const std::string& path) {
  for (const std::string& line : info.damage) complain("isoreel: warning: {}: {}\n", path, line);
}

Status named(const Status& status, const std::string& path) {
  const std::string name = path == "-" ? "standard input" : path;
  return status.ok() || status.message().starts_with(name + ":") ? status : status.at(name);
}

std::string uuidText(const std::array<std::uint8_t, 16>& uuid) {
  std::string text;
  for (std::size_t i = 0; i < uuid.size(); ++i) {
    if (i == 4 || i == 6 || i == 8 || i == 10) text += '-';
    text += fmt::format("{:02x}", uuid[i]);
  }
  return text;
}

}  // namespace isoreel::cli
