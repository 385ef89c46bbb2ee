// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

namespace isoreel {

/// Clears, and makes room for `size` elements: never takes more than these need, nor more while it is at it.
template <class T>
void clearFor(std::vector<T>& vector, std::size_t size) {
  if (vector.capacity() < size) vector = std::vector<T>();  // not {}, which keeps the memory
  vector.clear();
  vector.reserve(size);
}

/// Where memory is kept for the next frame, which may be a little larger: so many elements, and an eighth.
constexpr std::size_t roomFor(std::size_t size) { return size + size / 8; }

/// Like resize(), but what is in there may be lost, and it never takes more than roomFor(size), nor keeps
/// more than twice as much as is needed.
template <class T>
void setSize(std::vector<T>& vector, std::size_t size) {
  if (vector.capacity() < size || vector.capacity() / 2 > size) {
    vector = std::vector<T>();
    vector.reserve(roomFor(size));
  }
  vector.resize(size);
}

template <class T>
std::size_t bytesOf(const std::vector<T>& vector) {
  return vector.capacity() * sizeof(T);
}

}  // namespace isoreel
