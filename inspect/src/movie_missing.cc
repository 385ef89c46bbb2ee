// SPDX-License-Identifier: BSD-3-Clause
// Stands in for movie.cc in a build without libav.
#include <isoreel/inspect/movie.h>

namespace isoreel::inspect {

struct MovieWriter::State {};

MovieWriter::MovieWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
MovieWriter::MovieWriter(MovieWriter&&) noexcept = default;
MovieWriter& MovieWriter::operator=(MovieWriter&&) noexcept = default;
MovieWriter::~MovieWriter() = default;

Result<MovieWriter> MovieWriter::create(const std::filesystem::path& path, int, int, TimeBase) {
  return {ErrorCode::kUnsupported, path.string() + ": this build writes no movies (ISOREEL_WITH_MOVIES)"};
}
// Nobody can have a writer to call these on.
Status MovieWriter::add(const Image&, std::int64_t, std::uint64_t) {
  return {ErrorCode::kUnsupported, "no movies"};
}
Status MovieWriter::finish() { return {ErrorCode::kUnsupported, "no movies"}; }

}  // namespace isoreel::inspect
