// SPDX-License-Identifier: BSD-3-Clause
#include <isoreel/io/volume_reader.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <fstream>

#include "src/byte_stream.h"
#include "src/files.h"
#include "src/format.h"

namespace isoreel::io {
namespace {

// What the libraries under us throw ends here, with the file's name in front.
Error caught(const std::string& name, const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr)
    return {ErrorCode::kLimit, name + ": asks for more memory than there is"};
  return {ErrorCode::kBadData, fmt::format("{}: {}", name, error.what())};
}

class Guarded : public VolumeSequence {
 public:
  explicit Guarded(std::unique_ptr<VolumeSequence> inner) : inner_(std::move(inner)) {}
  std::size_t size() const override { return inner_->size(); }
  const Grid& grid() const override { return inner_->grid(); }
  bool levelSet() const override { return inner_->levelSet(); }
  std::optional<double> time(std::size_t i) const override { return inner_->time(i); }
  std::string name(std::size_t i) const override { return inner_->name(i); }
  Result<Volume> read(std::size_t i) override {
    try {
      return inner_->read(i);
    } catch (const std::exception& error) {
      return caught(inner_->name(i), error);
    }
  }

 private:
  std::unique_ptr<VolumeSequence> inner_;
};

// The first of `path`, which has one byte at least.
Result<FileHead> readHead(const std::string& path) {
  ISOREEL_ASSIGN(const std::uint64_t size, regularFileSize(path));
  if (size == 0) return {ErrorCode::kBadData, path + ": the file is empty"};
  FileHead head{path, std::string(4096, '\0'), {}};
  std::ifstream file(path, std::ios::binary);
  if (!file) return {ErrorCode::kIo, path + ": cannot be opened"};
  file.read(head.bytes.data(), static_cast<std::streamsize>(head.bytes.size()));
  head.bytes.resize(static_cast<std::size_t>(file.gcount()));
  if (startsAsGzip(head.bytes)) {
    ISOREEL_ASSIGN(const auto stream, ByteStream::open(path, 0, Coding::kDeflated));
    std::array<std::uint8_t, 4096> inflated;
    // Broken gzip is a file like any other that is no volume.
    const auto count = stream->readSome(inflated);
    if (count.ok())
      head.inflated.assign(inflated.begin(), inflated.begin() + static_cast<std::ptrdiff_t>(*count));
  }
  return head;
}

const Format* sniff(const FileHead& head) {
  for (const Format& format : formats()) {
    if (format.sniff(head)) return &format;
  }
  return nullptr;
}

std::string knownFormats() { return fmt::format("this build reads {}", fmt::join(volumeFormats(), ", ")); }

struct SniffedFiles {
  std::vector<std::string> files;
  const Format* format = nullptr;
};

// Adds the volume files of one input to `sniffed`.
Status addInput(const std::string& input, SniffedFiles& sniffed) {
  ISOREEL_ASSIGN(const FoundFiles found, findFiles(input));
  const std::size_t before = sniffed.files.size();
  for (const std::string& file : found.files) {
    const Result<FileHead> head = readHead(file);
    const Format* format = head.ok() ? sniff(*head) : nullptr;
    if (format == nullptr && found.folder) continue;
    if (!head.ok()) return head.status();
    if (format == nullptr) {
      return {ErrorCode::kUnsupported, fmt::format("{}: not a volume file; {}", file, knownFormats())};
    }
    if (format->open == nullptr) {
      return {ErrorCode::kUnsupported,
              fmt::format("{}: built without {}; {}", file, format->name, knownFormats())};
    }
    if (sniffed.format != nullptr && sniffed.format != format) {
      return {ErrorCode::kInvalidArgument,
              fmt::format("{} is {} but {} is {}: a sequence has one format", sniffed.files.front(),
                          sniffed.format->name, file, format->name)};
    }
    sniffed.format = format;
    sniffed.files.push_back(file);
  }
  if (sniffed.files.size() == before) {
    return {ErrorCode::kNotFound,
            fmt::format("{}: no volume file in this folder; {}", input, knownFormats())};
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<VolumeSequence>> openVolumes(const std::vector<std::string>& inputs,
                                                    const VolumeOptions& options) {
  if (inputs.empty()) return {ErrorCode::kInvalidArgument, "no volume files given"};
  SniffedFiles sniffed;
  try {
    for (const std::string& input : inputs) ISOREEL_TRY(addInput(input, sniffed));
    ISOREEL_ASSIGN(auto sequence, sniffed.format->open(sniffed.files, options));
    return std::unique_ptr<VolumeSequence>(std::make_unique<Guarded>(std::move(sequence)));
  } catch (const std::exception& error) {
    return caught(sniffed.files.empty() ? inputs.front() : sniffed.files.front(), error);
  }
}

std::vector<std::string> volumeFormats() {
  std::vector<std::string> names;
  for (const Format& format : formats()) {
    if (format.open != nullptr) names.emplace_back(format.name);
  }
  return names;
}

}  // namespace isoreel::io
