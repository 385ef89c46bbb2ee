// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <isoreel/io/volume_reader.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

namespace isoreel::io {

/// A test with a folder of its own, which goes with it.
class IoTest : public testing::Test {
 protected:
  IoTest() {
    std::string name = (std::filesystem::temp_directory_path() / "isoreel-io-XXXXXX").string();
    folder_ = mkdtemp(name.data()) != nullptr ? name : "";
  }
  ~IoTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, const std::string& content) const {
    std::filesystem::remove(path(name));  // cutting a file to 0 first makes ext4 wait for the disk
    std::ofstream(path(name), std::ios::binary) << content;
  }
  std::string content(const std::string& name) const {
    std::ifstream file(path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  /// Files in the folder.
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder_), {}));
  }

  std::filesystem::path folder_;
};

/// What openVolumes or its first read says against `inputs`; "" when it reads them all.
inline std::string errorOf(const std::vector<std::string>& inputs, const VolumeOptions& options = {}) {
  auto sequence = openVolumes(inputs, options);
  if (!sequence.ok()) return sequence.error().message;
  for (std::size_t i = 0; i < (*sequence)->size(); ++i) {
    if (const auto volume = (*sequence)->read(i); !volume.ok()) return volume.error().message;
  }
  return "";
}

inline testing::AssertionResult contains(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos && text.find('\n') == std::string::npos)
    return testing::AssertionSuccess();
  return testing::AssertionFailure() << "\"" << text << "\" does not say \"" << part << "\" in one line";
}

/// Bytes of `values` in `order`.
template <class T>
std::string bytesOf(const std::vector<T>& values, std::endian order = std::endian::native) {
  std::string bytes(values.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  for (std::size_t i = 0; order != std::endian::native && i < bytes.size(); i += sizeof(T)) {
    std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(i),
                 bytes.begin() + static_cast<std::ptrdiff_t>(i + sizeof(T)));
  }
  return bytes;
}

/// `count` values over the whole range of T, with its extremes first.
template <class T>
std::vector<T> spread(std::size_t count) {
  std::vector<T> values(count);
  for (std::size_t i = 0; i < count; ++i) {
    if constexpr (std::is_floating_point_v<T>) {
      values[i] = static_cast<T>(static_cast<double>(i) * 0.37 - 3.1);
    } else {
      values[i] = static_cast<T>(i * 0x9e3779b97f4a7c15u >> (64 - 8 * sizeof(T)));
    }
  }
  values[0] = std::numeric_limits<T>::lowest();
  values[1] = std::numeric_limits<T>::max();
  if constexpr (std::is_floating_point_v<T>) {
    values[0] = static_cast<T>(-1e30);
    values[1] = static_cast<T>(1e-30);
    values[2] = std::numeric_limits<T>::infinity();
    values[3] = std::numeric_limits<T>::quiet_NaN();
  }
  return values;
}

/// Each sample is its source's nearest float; not-a-number stays so.
template <class T>
void expectSamples(const Volume& volume, const std::vector<T>& values, std::size_t from = 0) {
  ASSERT_GE(values.size(), from + volume.samples.size());
  ASSERT_EQ(volume.samples.size(), volume.grid.nodeCount());
  for (std::size_t i = 0; i < volume.samples.size(); ++i) {
    const auto expected = static_cast<float>(values[from + i]);
    if (expected != expected) {
      EXPECT_NE(volume.samples[i], volume.samples[i]) << "sample " << i;
    } else {
      ASSERT_EQ(volume.samples[i], expected) << "sample " << i;
    }
  }
}

using ScalarTypes = testing::Types<std::int8_t, std::uint8_t, std::int16_t, std::uint16_t, std::int32_t,
                                   std::uint32_t, std::int64_t, std::uint64_t, float, double>;

}  // namespace isoreel::io
