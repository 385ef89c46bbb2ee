// SPDX-License-Identifier: BSD-3-Clause
#include "options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>
#include <optional>
#include <regex>

namespace isoreel::cli {
namespace {

template <class Number>
std::optional<Number> parseNumber(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

// printf's %d with optional zero padding and width: the only conversion that output names may hold.
const std::regex kCounter("%(0?)([1-9]?)d");

}  // namespace

Fraction parseFraction(const std::string& option, const std::string& text) {
  const auto refuse = [&]() -> Fraction {
    throw CLI::ValidationError(option, fmt::format("'{}' is no number: 25, 30000/1001 and 0.04 are", text));
  };
  const std::size_t slash = text.find('/');
  if (slash != std::string::npos) {
    const auto numerator = parseNumber<std::int64_t>(std::string_view(text).substr(0, slash));
    const auto denominator = parseNumber<std::int64_t>(std::string_view(text).substr(slash + 1));
    if (!numerator || !denominator || *denominator <= 0) return refuse();
    const std::int64_t common = std::gcd(*numerator, *denominator);
    return {*numerator / common, *denominator / common};
  }
  std::string digits = text;
  std::int64_t denominator = 1;
  if (const std::size_t point = text.find('.'); point != std::string::npos) {
    digits.erase(point, 1);
    if (text.size() - point - 1 > 15) return refuse();
    for (std::size_t i = point + 1; i < text.size(); ++i) denominator *= 10;
  }
  const auto numerator = parseNumber<std::int64_t>(digits);
  if (!numerator) return refuse();
  const std::int64_t common = std::gcd(*numerator, denominator);
  return {*numerator / common, denominator / common};
}

std::vector<double> parseNumbers(const std::string& option, const std::string& text) {
  std::vector<double> values;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t end = std::min(text.find(',', start), text.size());
    const auto value = parseNumber<double>(std::string_view(text).substr(start, end - start));
    if (!value || *value - *value != 0)
      throw CLI::ValidationError(option, fmt::format("'{}' is no number", text.substr(start, end - start)));
    values.push_back(*value);
    start = end + 1;
  }
  return values;
}

FrameTimes constantRate(const std::string& fps, std::size_t frames) {
  const Fraction rate = parseFraction("--fps", fps);
  constexpr std::int64_t kMax = std::numeric_limits<std::uint32_t>::max();
  if (rate.numerator <= 0 || rate.numerator > kMax || rate.denominator > kMax) {
    throw CLI::ValidationError("--fps", fmt::format("'{}' is not above 0, or has too many digits", fps));
  }
  FrameTimes result{
      {static_cast<std::uint32_t>(rate.denominator), static_cast<std::uint32_t>(rate.numerator)}, {}, {}};
  result.times.resize(frames);
  std::iota(result.times.begin(), result.times.end(), std::int64_t{0});
  result.durations.assign(frames, 1);
  return result;
}

FrameTimes timesFromFile(const std::string& path, std::size_t frames) {
  std::ifstream file(path);
  if (!file) throw CLI::ValidationError("--times", path + ": cannot be read");
  std::vector<Fraction> times;
  std::vector<std::size_t> lines;  // where each stands, for messages
  std::string line;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    line = line.substr(0, line.find('#'));
    line.erase(0, line.find_first_not_of(" \t\r"));
    line.erase(line.find_last_not_of(" \t\r") + 1);
    if (line.empty()) continue;
    times.push_back(parseFraction(fmt::format("--times: {} line {}", path, number), line));
    lines.push_back(number);
  }
  if (times.size() != frames) {
    throw CLI::ValidationError("--times",
                               fmt::format("{}: {} times for {} frames", path, times.size(), frames));
  }
  std::int64_t denominator = 1;
  for (const Fraction& t : times) {
    const std::int64_t factor = t.denominator / std::gcd(denominator, t.denominator);
    if (factor > std::int64_t{std::numeric_limits<std::uint32_t>::max()} / denominator) {
      throw CLI::ValidationError(
          "--times",
          path + ": the times have no common denominator below 2^32; give them as fractions of one");
    }
    denominator *= factor;
  }
  FrameTimes result{{1, static_cast<std::uint32_t>(denominator)}, {}, {}};
  for (std::size_t i = 0; i < times.size(); ++i) {
    std::int64_t ticks = 0;
    if (__builtin_mul_overflow(times[i].numerator, denominator / times[i].denominator, &ticks)) {
      throw CLI::ValidationError("--times", fmt::format("{} line {}: the time is too large", path, lines[i]));
    }
    if (i > 0 && ticks <= result.times.back()) {
      throw CLI::ValidationError(
          "--times",
          fmt::format("{} line {}: the time does not come after the one before it", path, lines[i]));
    }
    if (i > 0)
      result.durations.push_back(static_cast<std::uint64_t>(ticks) -
                                 static_cast<std::uint64_t>(result.times.back()));
    result.times.push_back(ticks);
  }
  result.durations.push_back(result.durations.empty() ? static_cast<std::uint64_t>(denominator)
                                                      : result.durations.back());
  return result;
}

std::optional<FrameTimes> timesInSeconds(const std::vector<double>& seconds) {
  constexpr std::int64_t kTicks = 1'000'000'000;
  constexpr double kCentury = 100 * 365.25 * 24 * 3600;
  if (seconds.size() < 2) return std::nullopt;
  std::vector<std::int64_t> ticks;
  std::int64_t common = kTicks;
  for (const double t : seconds) {
    if (!(std::abs(t) < kCentury)) return std::nullopt;
    ticks.push_back(std::llround(t * kTicks));
    if (ticks.size() > 1 && ticks.back() <= ticks[ticks.size() - 2]) return std::nullopt;
    common = std::gcd(common, ticks.back());
  }
  FrameTimes result{{1, static_cast<std::uint32_t>(kTicks / common)}, {}, {}};
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const std::size_t next = std::min(i + 1, ticks.size() - 1);
    result.times.push_back(ticks[i] / common);
    result.durations.push_back(static_cast<std::uint64_t>((ticks[next] - ticks[next - 1]) / common));
  }
  return result;
}

bool countsFrames(const std::string& pattern) {
  const auto signs = std::count(pattern.begin(), pattern.end(), '%');
  const bool counts = std::regex_search(pattern, kCounter);
  if (signs > (counts ? 1 : 0))
    throw CLI::ValidationError("--output", fmt::format("'{}': a single %d or %05d counts frames", pattern));
  return counts;
}

std::string frameName(const std::string& pattern, std::uint64_t number) {
  std::smatch match;
  if (!std::regex_search(pattern, match, kCounter)) return pattern;
  const std::string digits = fmt::format("{}", number);
  const std::size_t width = match[2].str().empty() ? 0 : static_cast<std::size_t>(match[2].str()[0] - '0');
  const std::string padding(width > digits.size() ? width - digits.size() : 0,
                            match[1].str().empty() ? ' ' : '0');
  return match.prefix().str() + padding + digits + match.suffix().str();
}

}  // namespace isoreel::cli
