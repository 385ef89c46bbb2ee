// SPDX-License-Identifier: BSD-3-Clause
#include "src/format.h"

#include <fstream>
#include <iterator>

namespace isoreel::io {
namespace {

// An object that mentions "dims" anywhere. Broken JSON is still ours, so that its user hears where it breaks,
// but other JSON in a folder of volumes (isovalues, notes) is not.
bool sniffRawJson(const FileHead& head) {
  const std::size_t start = head.bytes.find_first_not_of(" \t\r\n");
  if (start == std::string::npos || head.bytes[start] != '{') return false;
  if (head.bytes.find("\"dims\"") != std::string::npos) return true;
  std::ifstream file(head.path, std::ios::binary);
  const std::string marker = "\"dims\"";
  std::size_t matched = 0;
  for (std::istreambuf_iterator<char> c(file), end; c != end; ++c) {
    matched = *c == marker[matched] ? matched + 1 : (*c == '"' ? 1 : 0);
    if (matched == marker.size()) return true;
  }
  return false;
}

bool sniffNrrd(const FileHead& head) { return head.bytes.starts_with("NRRD000"); }

bool sniffOpenVdb(const FileHead& head) {
  return head.bytes.starts_with(std::string_view(" BDV\0\0\0\0", 8));
}

constexpr Format kFormats[] = {
    {"raw + JSON", sniffRawJson, openRawJson},
#ifdef ISOREEL_WITH_NRRD
    {"NRRD", sniffNrrd, openNrrd},
#else
    {"NRRD", sniffNrrd, nullptr},
#endif
#ifdef ISOREEL_WITH_OPENVDB
    {"OpenVDB", sniffOpenVdb, openOpenVdb},
#else
    {"OpenVDB", sniffOpenVdb, nullptr},
#endif
};

}  // namespace

std::span<const Format> formats() { return kFormats; }

}  // namespace isoreel::io
