// SPDX-License-Identifier: BSD-3-Clause
#include "src/embree.h"

#include <cstring>
#include <new>

#if defined(__SANITIZE_THREAD__)
#define ISOREEL_THREAD_CHECK
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define ISOREEL_THREAD_CHECK
#endif
#endif
#ifdef ISOREEL_THREAD_CHECK
// Embree and oneTBB come without the instrumentation that tells the thread sanitizer how their threads
// synchronise.
// NOLINTNEXTLINE: the sanitizer gives this its name
extern "C" const char* __tsan_default_suppressions() {
  return "called_from_lib:libembree3.so\nrace:libembree3.so\nrace:libtbb.so";
}
#endif

namespace isoreel::inspect {
namespace {

template <class Element>
void fill(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::span<const Element> elements) {
  // Embree allocates, so that the padding which its wide loads need is there.
  void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(Element), elements.size());
  if (buffer == nullptr) throw std::bad_alloc();
  std::memcpy(buffer, elements.data(), elements.size_bytes());
}

}  // namespace

TriangleScene::TriangleScene(std::span<const std::array<float, 3>> points,
                             std::span<const Triangle> triangles, RTCPointQueryFunction query,
                             RTCFilterFunctionN filter)
    : device_(rtcNewDevice(nullptr)) {
  if (!device_) throw std::bad_alloc();
  scene_.reset(rtcNewScene(device_.get()));
  rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
  if (!triangles.empty()) {
    const EmbreeOwner<RTCGeometry> geometry(rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
    fill(geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, points);
    fill(geometry.get(), RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, triangles);
    if (query != nullptr) rtcSetGeometryPointQueryFunction(geometry.get(), query);
    if (filter != nullptr) rtcSetGeometryIntersectFilterFunction(geometry.get(), filter);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene_.get(), geometry.get());
  }
  rtcCommitScene(scene_.get());
  if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE) throw std::bad_alloc();
}

}  // namespace isoreel::inspect
