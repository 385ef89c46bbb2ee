// SPDX-License-Identifier: BSD-3-Clause
// Parts of one encode, made apart from each other: `encode --frames A:B` writes into the tags where a part
// belongs.
#pragma once

#include <isoreel/base/status.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "metadata.h"

namespace isoreel::cli {

/// Frames [begin, end) of the `frames` that a whole encode has, in GOPs of `gop`.
struct Shard {
  std::uint64_t begin = 0, end = 0, frames = 0, gop = 0;
};

/// The value of the tag that says so, "shard".
Json shardTag(const Shard& shard);
/// What the tags (a JSON object) say; nothing when they say nothing that makes sense.
std::optional<Shard> shardOf(const std::string& tags);
/// The tags without it; the very text when it is not there.
std::string withoutShard(const std::string& tags);

/// The order in which shards make up a whole encode: indices into `shards`. kInvalidArgument, with a list of
/// what is missing, there twice, or does not begin with a GOP, when they don't. `names` are for that list.
Result<std::vector<std::size_t>> orderOfShards(const std::vector<Shard>& shards,
                                               const std::vector<std::string>& names);

}  // namespace isoreel::cli
