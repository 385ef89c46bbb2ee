// SPDX-License-Identifier: BSD-3-Clause
// Which files an input means, and what may be opened at all.
#pragma once

#include <isoreel/base/status.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace isoreel::io {

/// The size in bytes of the regular file `path`. Errors: kNotFound; kIo for what is not a regular file (a
/// device or pipe could hang a reader or never end).
Result<std::uint64_t> regularFileSize(const std::string& path);

/// A file name with one number in it, as printf writes it: "frame_%04d.vdb".
struct NumberedName {
  std::string before, after;
  std::size_t width = 0;
  bool zeros = false;

  /// Nothing when `name` has not exactly one conversion, %d or %0Nd or %Nd with N up to 20.
  static std::optional<NumberedName> parse(std::string_view name);
  std::string with(std::uint64_t number) const;
  /// The number in `name`, if `name` is what with() gives for it.
  std::optional<std::uint64_t> numberIn(std::string_view name) const;
};

/// a2 before a10: runs of digits compare as numbers.
bool naturallyLess(std::string_view a, std::string_view b);

/// The files that `input` means, and whether they were found by looking through a folder (then files of other
/// kinds are no error): a file's own name, the entries of a folder in natural order, the files of a printf
/// pattern from the lowest number that exists to the highest, or those of a glob in natural order (a file of
/// that very name goes first). Errors: kNotFound, which names what is missing, also for gaps.
struct FoundFiles {
  std::vector<std::string> files;
  bool folder = false;
};
Result<FoundFiles> findFiles(const std::string& input);

}  // namespace isoreel::io
