// SPDX-License-Identifier: BSD-3-Clause
// What `info --packets` tells.
#pragma once

#include <nlohmann/json.hpp>

#include "input.h"

namespace isoreel::cli {

const char* typeName(PacketType type);

/// Every packet of the file in order, as `info --json` has them. P packets are decoded for what their blocks
/// do, GOPs side by side; one that cannot be decoded has a "problem" instead. Errors name the file.
Result<nlohmann::ordered_json> packetList(const Input& input, const std::string& path, int jobs);

/// The same for people.
void printPackets(const nlohmann::ordered_json& packets);

}  // namespace isoreel::cli
