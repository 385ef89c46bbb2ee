// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/inspect/render.h>
#include <png.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace isoreel::inspect {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

Status failure(const std::filesystem::path& path, const std::string& reason) {
  return {ErrorCode::kIo, path.string() + ": the PNG cannot be written: " + reason};
}

Status writeTo(std::FILE* opened, const Image& image, const std::filesystem::path& path) {
  std::unique_ptr<std::FILE, CloseFile> file(opened);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGBA;
  if (png_image_write_to_stdio(&png, file.get(), 0, image.pixels.data(), 0, nullptr) == 0) {
    return failure(path, png.message);
  }
  return std::fclose(file.release()) == 0 ? Status() : failure(path, std::strerror(errno));
}

}  // namespace

Status writePng(const Image& image, const std::filesystem::path& path) {
  if (image.width < 1 || image.height < 1 ||
      image.pixels.size() !=
          static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 4) {
    return {ErrorCode::kInvalidArgument, path.string() + ": a picture of " + std::to_string(image.width) +
                                             " x " + std::to_string(image.height) + " pixels does not have " +
                                             std::to_string(image.pixels.size()) + " bytes"};
  }
  std::filesystem::path temporary = path;
  temporary += ".part";
  std::FILE* file = std::fopen(temporary.c_str(), "wb");
  if (file == nullptr) return failure(path, std::strerror(errno));
  Status status = writeTo(file, image, path);
  std::error_code error;
  if (status.ok()) {
    std::filesystem::rename(temporary, path, error);
    if (!error) return status;
    status = failure(path, error.message());
  }
  std::filesystem::remove(temporary, error);
  return status;
}

}  // namespace isoreel::inspect
