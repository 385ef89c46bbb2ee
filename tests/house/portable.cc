// SPDX-License-Identifier: BSD-3-Clause
// Decodes packets and prints the hash of each surface (spec codec 7): portable.py builds it in many ways.
//
//   portable PACKET... [-- PACKET...]...   each run between "--" by a decoder of its own
#include <isoreel/codec/decoder.h>

#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>

int main(int argc, char** argv) {
  isoreel::Decoder decoder;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--") == 0) {
      decoder = isoreel::Decoder();
      continue;
    }
    std::ifstream file(argv[i], std::ios::binary);
    const isoreel::Bytes packet{std::istreambuf_iterator<char>(file), {}};
    const auto surface = decoder.decode(packet);
    if (!surface) {
      std::fprintf(stderr, "%s: %s\n", argv[i], surface.error().message.c_str());
      return 1;
    }
    std::printf("%s %016" PRIx64 "\n", argv[i], isoreel::surfaceHash(*surface));
  }
  return 0;
}
