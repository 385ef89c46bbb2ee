// SPDX-License-Identifier: BSD-3-Clause
#include "packet_list.h"

#include <fmt/format.h>
#include <isoreel/codec/decoder.h>

#include <algorithm>

#include "decoding.h"
#include "gop.h"
#include "parallel.h"
#include "progress.h"

namespace isoreel::cli {
namespace {

using Json = nlohmann::ordered_json;

Json packetJson(const PacketHeader& header, std::size_t bytes) {
  Json sections = Json::array();
  for (const Section& s : header.sections) {
    static constexpr std::array<const char*, 5> kNames{"?", "signs", "leaves", "motion", "vertices"};
    sections.push_back({{"kind", s.kind < kNames.size() ? kNames[s.kind] : "unknown"},
                        {"level", s.level},
                        {"bytes", s.bytes}});
  }
  return {{"number", header.number},
          {"type", typeName(header.type)},
          {"bytes", bytes},
          {"references", header.references},
          {"step", header.step / double{kCell}},
          {"tangential_step", header.tangential_step / double{kCell}},
          {"sections", sections}};
}

/// Lengths are in cells, and over the blocks that move.
Json motionJson(const std::vector<MotionBlock>& blocks) {
  std::uint64_t moving = 0, vertices = 0, predicted = 0;
  double sum = 0, largest = 0;
  for (const MotionBlock& block : blocks) {
    vertices += block.vertices;
    predicted += block.predicted;
    if (!block.moves) continue;
    ++moving;
    sum += block.speed();
    largest = std::max(largest, block.speed());
  }
  return {{"block", blocks.empty() ? Json(nullptr) : Json(blocks.front().side)},
          {"blocks", blocks.size()},
          {"moving", moving},
          {"intra", blocks.size() - moving},
          {"mean", moving > 0 ? sum / static_cast<double>(moving) : 0},
          {"largest", largest},
          {"vertices", vertices},
          {"predicted", predicted}};
}

struct GopItem {
  Gop gop;
  std::vector<Json> packets;
};

/// `path`: for errors.
Status describe(GopItem& item, const std::string& path) {
  Decoder decoder(parallelWithin);
  const bool predicts =
      item.gop.packets.size() > 1 || item.gop.packets.front().header.type == PacketType::kPredicted;
  for (const Packet& packet : item.gop.packets) {
    if (interrupted) return {};
    const Result<PacketHeader> header = readPacketHeader(packet.data);
    if (!header) return header.status().at(fmt::format("{}: frame {}", path, packet.header.number));
    Json json = packetJson(*header, packet.data.size());
    json["motion"] = nullptr;
    if (predicts) {
      std::vector<MotionBlock> blocks;
      DecodeOptions options = decodeOptions();
      options.motion = &blocks;
      const Status status = decoder.decode(packet.data, options).status();
      if (!status.ok()) {
        json["problem"] = status.message();
      } else if (header->type == PacketType::kPredicted) {
        json["motion"] = motionJson(blocks);
      }
    }
    item.packets.push_back(std::move(json));
  }
  return {};
}

void printMotion(const Json& packet) {
  const Json& motion = packet["motion"];
  fmt::print("                 from {}: {} blocks",
             packet["number"].get<std::uint64_t>() - packet["references"][0].get<std::uint64_t>(),
             motion["blocks"].dump());
  if (motion["blocks"] != 0) {
    fmt::print(
        " of {} cells, {} predicted, moved by {:.3g} cells on average and {:.3g} at most, {} I blocks; "
        "{} of {} vertices predicted",
        motion["block"].dump(), motion["moving"].dump(), motion["mean"].get<double>(),
        motion["largest"].get<double>(), motion["intra"].dump(), motion["predicted"].dump(),
        motion["vertices"].dump());
  }
  fmt::print("\n");
}

}  // namespace

const char* typeName(PacketType type) { return type == PacketType::kIntra ? "I" : "P"; }

Result<Json> packetList(const Input& input, const std::string& path, int jobs) {
  const std::uint64_t count = input.packets->frameCount();
  const ThreadLimit limit(jobs);
  Progress progress("info", count);
  Json list = Json::array();
  std::uint64_t next = 0;
  GopSource gops([&](Packet& packet) -> Result<bool> {
    if (next == count) return false;
    packet.header = input.packets->header(next);
    Result<Bytes> data = input.packets->packet(next++);
    if (!data) return named(data.status(), path);
    packet.data = *std::move(data);
    return true;
  });
  ISOREEL_TRY(forEachFrame<GopItem>(
      jobs, [&](GopItem& item) { return gops.next(item.gop); },
      [&](GopItem& item) { return describe(item, path); },
      [&](GopItem& item) -> Status {
        for (Json& packet : item.packets) {
          list.push_back(std::move(packet));
          progress.advance();
        }
        return {};
      }));
  if (interrupted) return {ErrorCode::kIo, "interrupted"};
  return list;
}

void printPackets(const Json& packets) {
  for (const Json& packet : packets) {
    fmt::print("packet {:>5}  {}  {} bytes, step {:.6g}, tangential {:.6g}:", packet["number"].dump(),
               packet["type"].get<std::string>(), packet["bytes"].dump(), packet["step"].get<double>(),
               packet["tangential_step"].get<double>());
    for (const Json& s : packet["sections"]) {
      const bool levelled = s["kind"] == "signs" || s["kind"] == "leaves";
      fmt::print(" {}{} {}", s["kind"].get<std::string>(), levelled ? s["level"].dump() : "",
                 s["bytes"].dump());
    }
    fmt::print("\n");
    if (packet.contains("problem")) {
      fmt::print("                 {}\n", packet["problem"].get<std::string>());
    } else if (!packet["motion"].is_null()) {
      printMotion(packet);
    }
  }
}

}  // namespace isoreel::cli
