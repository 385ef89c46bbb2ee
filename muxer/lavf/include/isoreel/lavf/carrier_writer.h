// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/base/packet.h>
#include <isoreel/container/byte_source.h>
#include <isoreel/container/file_info.h>
#include <isoreel/lavf/carrier.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace isoreel::lavf {

/// A sequence to be written. The source stays the caller's.
struct CarrierTrack {
  PacketSource* packets = nullptr;
  TimeBase time_base;  // of the headers' times
  std::string name;
  Bytes configuration;  // the codec's configuration record
};

/// A file that travels along.
struct CarrierAttachment {
  Attachment facts;  // `offset` and `length` mean nothing here
  std::unique_ptr<ByteSource> content;
};

struct CarrierSettings {
  std::string tags = "{}";  // a JSON object
  std::vector<Chapter> chapters;
  TimeBase chapter_base;                       // of their times
  std::vector<CarrierAttachment> attachments;  // Matroska takes 256 MiB of them, in memory
  bool overwrite = false;                      // replace a file that is there already
  std::function<bool()> onPacket{};  // called after each; writing stops, and fails, when it gives false
};

/// Writes packets bit for bit into a file of another container (spec mappings), to PATH.part first. The same
/// input gives the same bytes. Returns what the carrier could not keep beside the packets, a line each.
///
/// kUnsupported when it cannot keep the packets' times and keys: hidden frames anywhere but at the start of a
/// MOV or MP4, AVI at other than a constant rate, a time base with more than 31 bits. kIo when the file is
/// there already, cannot be written, or when writing was stopped; nothing is left then. Errors of the
/// sources.
Result<std::vector<std::string>> writeCarrier(const std::filesystem::path& path, Carrier carrier,
                                              const std::vector<CarrierTrack>& tracks,
                                              const CarrierSettings& settings = {});

}  // namespace isoreel::lavf
