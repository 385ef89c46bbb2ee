// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <isoreel/inspect/movie.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "command.h"
#include "output.h"
#include "parallel.h"
#include "progress.h"
#include "render_scene.h"

namespace isoreel::cli {
namespace {

/// The frames of a contact sheet: all, or `tiles` of them evenly spread, first and last among them.
std::vector<std::uint64_t> tileFrames(const FrameRange& range, std::size_t tiles) {
  const std::size_t count = std::min<std::size_t>(tiles, static_cast<std::size_t>(range.size()));
  std::vector<std::uint64_t> frames;
  for (std::size_t i = 0; i < count; ++i) {
    frames.push_back(range.begin +
                     (count == 1 ? 0 : (i * (range.size() - 1) + (count - 1) / 2) / (count - 1)));
  }
  return frames;
}

/// When each frame is shown, from the start of the first.
class Schedule {
 public:
  Schedule(const RenderOptions& options, const Input& input, const FrameRange& range) : range_(range) {
    times_.base = input.info.time_base;
    if (!options.fps.empty()) times_ = constantRate(options.fps, static_cast<std::size_t>(range.size()));
    for (std::uint64_t i = range.begin; options.fps.empty() && i < range.end; ++i) {
      times_.times.push_back(input.packets->header(i).time);
      times_.durations.push_back(input.packets->header(i).duration);
    }
  }
  TimeBase base() const { return times_.base; }
  std::int64_t time(std::uint64_t position) const { return times_.times[index(position)]; }
  std::uint64_t duration(std::uint64_t position) const { return times_.durations[index(position)]; }
  /// Of the whole: 0 for the first frame, and below 1 for the last, so that a full turn closes.
  double part(std::uint64_t position) const {
    const double whole = since(times_.times.back()) + static_cast<double>(times_.durations.back());
    return whole > 0 ? since(time(position)) / whole : 0;
  }

 private:
  std::size_t index(std::uint64_t position) const {
    return static_cast<std::size_t>(position - range_.begin);
  }
  double since(std::int64_t time) const {
    return static_cast<double>(time) - static_cast<double>(times_.times.front());
  }

  FrameRange range_;
  FrameTimes times_;
};

/// Where pictures go, in the order of their frames.
class Output {
 public:
  Output(const RenderOptions& options, Product product, const Input& input, const Schedule& schedule)
      : options_(options), product_(product), input_(input), schedule_(schedule) {}

  Status add(std::uint64_t position, inspect::Image image) {
    const FrameHeader& header = input_.packets->header(position);
    switch (product_) {
      case Product::kPicture:
      case Product::kPictures: {
        const std::string path = frameName(options_.output, header.number);
        ISOREEL_TRY(mayWrite(path, options_.force));
        return inspect::writePng(image, path);
      }
      case Product::kSheet:
        images_.push_back(std::move(image));
        captions_.push_back(fmt::format("frame {}   {:.4g} s   {} vertices", header.number,
                                        input_.info.time_base.seconds(header.time), header.vertices));
        return {};
      case Product::kMovie:
        break;
    }
    if (!movie_) {
      ISOREEL_ASSIGN(
          inspect::MovieWriter movie,
          inspect::MovieWriter::create(options_.output, image.width, image.height, schedule_.base()));
      movie_ = std::make_unique<inspect::MovieWriter>(std::move(movie));
    }
    return movie_->add(image, schedule_.time(position), schedule_.duration(position));
  }

  Status finish() {
    if (movie_) return movie_->finish();
    if (product_ != Product::kSheet) return {};
    const int columns = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(images_.size()))));
    return inspect::writePng(inspect::contactSheet(images_, captions_, columns), options_.output);
  }

 private:
  const RenderOptions& options_;
  const Product product_;
  const Input& input_;
  const Schedule& schedule_;
  std::vector<inspect::Image> images_;
  std::vector<std::string> captions_;
  std::unique_ptr<inspect::MovieWriter> movie_;
};

struct Job {
  std::uint64_t position = 0;
  Scene::Item item;
};

Status render(const RenderOptions& options) {
  const Stopwatch watch;
  ISOREEL_ASSIGN(Scene scene, Scene::open(options));
  const Input& input = scene.input();
  const FrameRange range = parseFrames(options.frames, timelineOf(*input.packets, input.info.time_base));
  const Product product = productOf(options, range.size());
  ISOREEL_TRY(scene.prepare(range, product));
  const Schedule schedule(options, input, range);
  std::error_code ignored;
  if (const std::filesystem::path folder = std::filesystem::path(options.output).parent_path();
      !folder.empty()) {
    std::filesystem::create_directories(folder, ignored);
  }
  if (product != Product::kPictures) ISOREEL_TRY(mayWrite(options.output, options.force));
  const std::vector<std::uint64_t> frames =
      tileFrames(range, product == Product::kSheet ? options.tiles : static_cast<std::size_t>(range.size()));
  ISOREEL_TRY(scene.measureMotion(frames));

  const ThreadLimit limit(options.jobs);
  Progress progress("render", frames.size());
  Output output(options, product, input, schedule);
  std::size_t next = 0;
  int width = 0, height = 0;
  const auto read = [&](Job& job) -> Result<bool> {
    if (next == frames.size()) return false;
    job.position = frames[next++];
    job.item.turn = schedule.part(job.position);
    ISOREEL_TRY(scene.read(job.position, job.item));
    return true;
  };
  const auto work = [&](Job& job) -> Status {
    scene.draw(job.item);
    return {};
  };
  const auto write = [&](Job& job) -> Status {
    width = job.item.image.width;
    height = job.item.image.height;
    progress.advance();
    return output.add(job.position, std::move(job.item.image));
  };
  ISOREEL_TRY(forEachFrame<Job>(options.jobs, read, work, write));
  progress.clear();
  if (interrupted) return {ErrorCode::kIo, "interrupted"};
  ISOREEL_TRY(output.finish());
  if (options.json) {
    fmt::print(
        "{}\n",
        nlohmann::ordered_json{
            {"frames", frames.size()}, {"width", width}, {"height", height}, {"seconds", watch.seconds()}}
            .dump());
  } else {
    fmt::print("{}: {}, {} x {} pixels each, in {:.2f} s\n", options.output,
               counted(frames.size(), "picture"), width, height, watch.seconds());
  }
  return {};
}

}  // namespace

void addRenderCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb =
      app.add_subcommand("render", "A picture of a frame, pictures of all, a contact sheet or a movie");
  const auto options = std::make_shared<RenderOptions>();
  addOptions(*verb, *options);
  verb->callback([options, &chosen] { chosen = [options] { return render(*options); }; });
}

}  // namespace isoreel::cli
