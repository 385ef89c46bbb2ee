// SPDX-License-Identifier: BSD-3-Clause
// What info tells without decoding.
#include "support.h"

namespace isoreel::cli {
namespace {

class FactsTest : public CliTest {
 protected:
  FactsTest() {
    sequence();
    ok("isoreel encode seq.json -o seq.isr --iso 0 --gop 4");
  }
};

TEST_F(FactsTest, BytesOfFramesAreThoseOfTheirPackets) {
  const auto info = json("isoreel info seq.isr --frames --packets --json"),
             pipe = json("cat seq.isr | isoreel info - --frames --json");
  ASSERT_EQ(info["frame_list"].size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(info["frame_list"][i]["bytes"], info["packet_list"][i]["bytes"]);
    EXPECT_EQ(pipe["frame_list"][i], info["frame_list"][i]);
  }
}

TEST_F(FactsTest, EventsAreWhereTheNumberOfPiecesChanges) {
  const auto info = json("isoreel info seq.isr --frames --events --json");
  std::vector<int> pieces;
  for (const auto& frame : info["frame_list"]) pieces.push_back(frame["components"]);
  EXPECT_EQ(pieces.front(), 2);
  EXPECT_EQ(pieces.back(), 0);
  std::size_t changes = 0;
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    if (pieces[i] == pieces[i - 1]) continue;
    ASSERT_LT(changes, info["events"].size());
    const auto& event = info["events"][changes++];
    EXPECT_EQ(event["frame"], i);
    EXPECT_EQ(event["before"], pieces[i - 1]);
    EXPECT_EQ(event["after"], pieces[i]);
    EXPECT_EQ(event["kind"], pieces[i] == 0              ? "vanish"
                             : pieces[i] < pieces[i - 1] ? "merge or vanish"
                                                         : "split or appear");
  }
  EXPECT_EQ(info["events"].size(), changes);
  EXPECT_NE(ok("isoreel info seq.isr --events").find("1 to 0: vanish"), std::string::npos);
}

TEST_F(FactsTest, AChartOfThem) {
  ok("isoreel info seq.isr --plot facts.svg");
  EXPECT_NE(content("facts.svg").find("<svg"), std::string::npos);
  EXPECT_NE(content("facts.svg").find("</svg>"), std::string::npos);
  EXPECT_FALSE(there("facts.svg.part"));
  fails("isoreel info seq.isr --plot facts.svg", 1, "there already");
  ok("isoreel info seq.isr --plot facts.svg --force && isoreel trim seq.isr -o one.isr --from 7");
  ok("isoreel info one.isr --plot one.svg");  // a single frame without a surface
  fails("isoreel info seq.isr --plot facts.png", 2, "does not end in .svg");
  fails("isoreel info seq.isr --plot none/facts.svg", 1, "none/facts.svg");
}

}  // namespace
}  // namespace isoreel::cli
