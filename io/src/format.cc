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

bool sniffNifti(const FileHead& head) {
  using namespace std::string_view_literals;
  const std::string_view bytes = head.inflated.empty() ? head.bytes : head.inflated;
  if (bytes.size() < 348) return false;
  const std::string_view size = bytes.substr(0, 4), first = bytes.substr(344, 4), second = bytes.substr(4, 8);
  if (size == "\x5c\1\0\0"sv || size == "\0\0\1\x5c"sv) return first == "n+1\0"sv || first == "ni1\0"sv;
  return (size == "\x1c\2\0\0"sv || size == "\0\0\2\x1c"sv) &&
         (second == "n+2\0\r\n\x1a\n"sv || second == "ni2\0\r\n\x1a\n"sv);
}

// A header has no magic, but MetaIO starts it with one of these keys.
bool sniffMetaImage(const FileHead& head) {
  const std::string_view bytes = head.bytes;
  const bool starts =
      bytes.starts_with("ObjectType") || bytes.starts_with("NDims") || bytes.starts_with("Comment");
  return starts && bytes.substr(0, bytes.find('\n')).find('=') != std::string_view::npos &&
         bytes.find("NDims") != std::string_view::npos;
}

bool sniffVti(const FileHead& head) {
  const std::size_t root = head.bytes.find("<VTKFile");
  if (root == std::string::npos || head.bytes[head.bytes.find_first_not_of(" \t\r\n\xef\xbb\xbf")] != '<')
    return false;
  const std::string_view tag = std::string_view(head.bytes).substr(root, head.bytes.find('>', root) - root);
  return tag.find("\"ImageData\"") != std::string_view::npos ||
         tag.find("'ImageData'") != std::string_view::npos;
}

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
#ifdef ISOREEL_WITH_NIFTI
    {"NIfTI", sniffNifti, openNifti},
#else
    {"NIfTI", sniffNifti, nullptr},
#endif
    {"MetaImage", sniffMetaImage, openMetaImage},
#ifdef ISOREEL_WITH_VTI
    {"VTI", sniffVti, openVti},
#else
    {"VTI", sniffVti, nullptr},
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
