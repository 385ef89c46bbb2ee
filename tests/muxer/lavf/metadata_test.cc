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
       {std::string("{}"), std::string(R"({ "title" : "Drops", "n": [1, {"a": null}] })"),
        R"({"note":")" + longer + "\"}"}) {
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

/// Gives its content once, front to back; tells more than that, if it is to lie.
CarrierAttachment attachment(const std::string& name, const std::string& type, std::size_t bytes,
                             std::size_t told) {
  Attachment facts;
  facts.name = name;
  facts.media_type = type;
  facts.bytes = told;
  return {facts, openMemory(Bytes(bytes, 'x'))};
}

TEST_F(CarrierMetadata, MatroskaHasAttachments) {
  Sequence sequence = movingBall();
  CarrierSettings settings;
  // A picture, of which libavformat makes a stream, and others.
  settings.attachments.push_back(attachment("cover.png", "image/png", 3000, 3000));
  settings.attachments.push_back(attachment("case.json", "application/json", 2000000, 2000000));
  settings.attachments.push_back(attachment("a name", "", 1, 1));
  EXPECT_TRUE(write("x.mkv", sequence, {1, 25}, settings).empty());
  const auto reader = read("x.mkv");
  ASSERT_TRUE(reader);
  expectSame(*reader, sequence);
  ASSERT_EQ(reader->info().attachments.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const Attachment& facts = reader->info().attachments[i];
    EXPECT_EQ(facts, settings.attachments[i].facts);
    const auto content = reader->openAttachment(facts.name);
    ASSERT_TRUE(content.ok()) << content.status().message();
    EXPECT_EQ((*content)->size(), facts.bytes);
    Bytes last(1);
    EXPECT_EQ(*(*content)->read(facts.bytes - 1, last), 1u);
  }
  EXPECT_EQ(reader->openAttachment("other").error().code, ErrorCode::kNotFound);
  expectSame(*reader, sequence);
}

TEST_F(CarrierMetadata, AttachmentsThatDoNotFitStayBehind) {
  Sequence sequence = movingBall();
  CarrierSettings settings;
  settings.attachments.push_back(attachment("far too large", "", 10, (std::size_t{1} << 28) + 1));
  settings.attachments.push_back(attachment("empty", "", 0, 0));
  for (const char* name : {"x.mkv", "x.nut", "x.mov"}) {
    const auto notes = write(name, sequence, {1, 25}, settings);
    ASSERT_EQ(notes.size(), 2u) << name;
    EXPECT_TRUE(notes[0].starts_with("attachment 'far too large' stays behind")) << notes[0];
    EXPECT_TRUE(read(name)->info().attachments.empty());
  }
  settings.attachments.clear();
  settings.attachments.push_back(attachment("cut", "", 10, std::size_t{1} << 27));
  EXPECT_EQ(writeCarrier(path("y.mkv"), Carrier::kMatroska, {{&sequence, {1, 25}, "", recordOf(sequence)}},
                         settings)
                .error()
                .code,
            ErrorCode::kBadData);
  EXPECT_FALSE(std::filesystem::exists(path("y.mkv.part")));
}

}  // namespace
}  // namespace isoreel::lavf
