// SPDX-License-Identifier: BSD-3-Clause
#include "support.h"

namespace isoreel::lavf {
namespace {

using CarrierMetadata = LavfTest;

TEST_F(CarrierMetadata, TagsComeBackAsTheyWere) {
  Sequence sequence = movingBall();
  std::string longer;
  for (int i = 0; i < 1500; ++i) longer += i % 7 == 0 ? "ö" : "a";
  for (const std::string& tags :
       {std::string("{}"), std::string("{ \"title\" : \"Drops\", \"n\": [1, {\"a\": null}] }"),
        "{\"note\":\"" + longer + "\"}"}) {
    for (const char* name : {"x.nut", "x.mov", "x.mp4", "x.mkv"}) {
      CarrierSettings settings;
      settings.tags = tags;
      write(name, sequence, {1, 25}, settings);
      const auto reader = read(name);
      ASSERT_TRUE(reader);
      EXPECT_EQ(reader->info().tags, tags) << name;
    }
  }
}

TEST_F(CarrierMetadata, ChaptersAndMarkers) {
  using Kind = Chapter::Kind;
  Sequence sequence = movingBall();
  CarrierSettings settings;
  settings.chapters = {{Kind::kChapter, 0, 0, "Start"},
                       {Kind::kMarker, 3, 0, "Splash"},
                       {Kind::kChapter, 5, 2, "Middle, of a length"},
                       {Kind::kChapter, 8, 0, "To the end"}};
  settings.chapter_base = {1, 25};
  for (const char* name : {"x.nut", "x.mkv"}) {
    EXPECT_TRUE(write(name, sequence, {1, 25}, settings).empty());
    EXPECT_EQ(read(name)->info().chapters, settings.chapters) << name;
  }
  for (const char* name : {"x.mov", "x.mp4"}) {
    EXPECT_EQ(write(name, sequence, {1, 25}, settings).size(), 1u);
    const auto chapters = read(name)->info().chapters;
    ASSERT_EQ(chapters.size(), 3u) << name;
    EXPECT_EQ(chapters[0], settings.chapters[0]);
    EXPECT_EQ(chapters[1].start, 5);
    EXPECT_EQ(chapters[2], settings.chapters[3]);
  }
}

}  // namespace
}  // namespace isoreel::lavf
