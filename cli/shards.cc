// SPDX-License-Identifier: BSD-3-Clause
#include "shards.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace isoreel::cli {
namespace {

constexpr const char* kKey = "shard";

}  // namespace

Json shardTag(const Shard& shard) {
  return {{"begin", shard.begin}, {"end", shard.end}, {"frames", shard.frames}, {"gop", shard.gop}};
}

std::optional<Shard> shardOf(const std::string& tags) {
  const Json json = parsedTags(tags);
  if (!json.is_object() || !json.contains(kKey) || !json[kKey].is_object()) return std::nullopt;
  const Json& tag = json[kKey];
  const auto number = [&](const char* name) {
    return tag.contains(name) && tag[name].is_number_unsigned() ? tag[name].get<std::uint64_t>() : 0;
  };
  const Shard shard{number("begin"), number("end"), number("frames"), number("gop")};
  if (shard.begin >= shard.end || shard.end > shard.frames || shard.gop == 0) return std::nullopt;
  return shard;
}

std::string withoutShard(const std::string& tags) {
  Json json = parsedTags(tags);
  if (!json.is_object() || json.erase(kKey) == 0) return tags;
  return dumped(json);
}

Result<std::vector<std::size_t>> orderOfShards(const std::vector<Shard>& shards,
                                               const std::vector<std::string>& names) {
  std::vector<std::size_t> order(shards.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return shards[a].begin < shards[b].begin; });
  std::vector<std::string> problems;
  std::uint64_t next = 0;
  std::size_t last = 0;  // the one that reaches up to next
  const auto missing = [&](std::uint64_t end) {
    if (next < end) problems.push_back(fmt::format("frames {}:{} are missing", next, end));
  };
  for (const std::size_t i : order) {
    const Shard& shard = shards[i];
    missing(shard.begin);
    if (shard.begin < next) {
      problems.push_back(fmt::format("frames {}:{} are in {} and in {}", shard.begin,
                                     std::min(shard.end, next), names[last], names[i]));
    }
    if (shard.begin % shard.gop != 0) {
      problems.push_back(
          fmt::format("{} starts at frame {}, inside a GOP of {}", names[i], shard.begin, shard.gop));
    }
    if (shard.end > next) {
      next = shard.end;
      last = i;
    }
  }
  missing(shards.front().frames);
  if (problems.empty()) return order;
  return {
      ErrorCode::kInvalidArgument,
      fmt::format("these do not make up the {} frames of one encode: {} (--no-shards joins them as they are)",
                  shards.front().frames, fmt::join(problems, "; "))};
}

}  // namespace isoreel::cli
