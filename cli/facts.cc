// SPDX-License-Identifier: BSD-3-Clause
#include "facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace isoreel::cli {
namespace {

using inspect::ChartRow;

/// `value(header, frame)` for every frame.
template <class Value>
ChartRow rowOf(const PacketSource& packets, std::string title, ChartRow::Style style, Value value) {
  ChartRow row;
  row.title = std::move(title);
  row.style = style;
  for (std::uint64_t i = 0; i < packets.frameCount(); ++i)
    row.values.push_back(static_cast<double>(value(packets.header(i), i)));
  return row;
}

std::string extremes(const ChartRow& row) {
  const auto [least, most] = std::minmax_element(row.values.begin(), row.values.end());
  return fmt::format("{} to {}", inspect::shortNumber(*least), inspect::shortNumber(*most));
}

}  // namespace

const char* kindName(Event::Kind kind) {
  static constexpr std::array<const char*, 4> kNames{"appear", "vanish", "split or appear",
                                                     "merge or vanish"};
  return kNames[static_cast<std::size_t>(kind)];
}

Json errorJson(ErrorKind kind, double rms, double max) {
  static constexpr std::array<const char*, 3> kKinds{"none", "extracted", "volume"};
  return {{"against", kKinds[static_cast<std::size_t>(kind)]}, {"rms", rms}, {"max", max}};
}

std::vector<Event> findEvents(const PacketSource& packets) {
  std::vector<Event> events;
  for (std::uint64_t i = 1; i < packets.frameCount(); ++i) {
    const std::uint32_t before = packets.header(i - 1).components, after = packets.header(i).components;
    if (after == before) continue;
    const Event::Kind kind = before == 0      ? Event::Kind::kAppear
                             : after == 0     ? Event::Kind::kVanish
                             : after > before ? Event::Kind::kSplitOrAppear
                                              : Event::Kind::kMergeOrVanish;
    events.push_back({i, kind, before, after});
  }
  return events;
}

inspect::Chart chartOfFacts(const Input& input, const std::string& title) {
  const PacketSource& packets = *input.packets;
  const TimeBase base = input.info.time_base;
  inspect::Chart chart;
  chart.title = title;
  chart.time_title = "time in seconds";
  for (std::uint64_t i = 0; i < packets.frameCount(); ++i) {
    const FrameHeader& header = packets.header(i);
    chart.times.push_back(base.seconds(header.time));
    chart.end = chart.times.back() + base.seconds(header.duration);
  }

  ChartRow bytes =
      rowOf(packets, "Bytes of a frame", ChartRow::Style::kBars,
            [&](const FrameHeader&, std::uint64_t i) { return packets.entryBytes(packets.entryOf(i)); });
  bytes.kind_names = {"I frames", "P frames"};
  for (std::uint64_t i = 0; i < packets.frameCount(); ++i)
    bytes.kinds.push_back(packets.header(i).type == PacketType::kPredicted);
  const double sum = std::accumulate(bytes.values.begin(), bytes.values.end(), 0.0);
  bytes.note = fmt::format("{}, {} in all", extremes(bytes), inspect::shortNumber(sum));
  chart.rows.push_back(std::move(bytes));

  const auto add = [&](const char* name, ChartRow::Style style, auto value) -> ChartRow& {
    ChartRow row = rowOf(packets, name, style, [&](const FrameHeader& h, std::uint64_t) { return value(h); });
    row.note = extremes(row);
    return chart.rows.emplace_back(std::move(row));
  };
  add("Area, world units squared", ChartRow::Style::kCurve, [](const FrameHeader& h) { return h.area; });
  add("Volume inside, world units cubed", ChartRow::Style::kCurve,
      [](const FrameHeader& h) { return h.volume; });
  ChartRow& pieces =
      add("Pieces of surface", ChartRow::Style::kSteps, [](const FrameHeader& h) { return h.components; });
  const std::vector<Event> events = findEvents(packets);
  pieces.note += fmt::format(", {} changes", events.size());
  if (events.size() > 60) return chart;  // lines side by side tell nothing
  for (const Event& event : events) pieces.marks.push_back(static_cast<std::size_t>(event.frame));
  return chart;
}

}  // namespace isoreel::cli
