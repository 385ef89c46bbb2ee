// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

namespace isoreel {

/// Clears, and makes room for `size` elements: never takes more than these need, nor more while it is at it.
template <class T>
void clearFor(std::vector<T>& vector, std::size_t size) {
  if (vector.capacity() < size) vector = {};
  vector.clear();
  vector.reserve(size);
}

/// Like resize(), but what is in there is lost when it grows, and it never takes more than `size` needs.
template <class T>
void setSize(std::vector<T>& vector, std::size_t size) {
  if (vector.capacity() < size) vector = {};
  vector.resize(size);
}

template <class T>
std::size_t bytesOf(const std::vector<T>& vector) {
  return vector.capacity() * sizeof(T);
}

}  // namespace isoreel
