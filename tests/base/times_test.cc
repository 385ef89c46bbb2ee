// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <isoreel/base/packet.h>

#include <limits>
#include <vector>

namespace isoreel {
namespace {

TEST(Times, TicksAreExact) {
  const TimeBase film{1001, 30000};
  EXPECT_EQ(film.tickAt(1001, 30000), 1);
  EXPECT_EQ(film.tickAt(1000, 30000), 0);
  EXPECT_EQ(film.tickAt(-1, 1000000), -1);
  EXPECT_EQ(film.tickAt(-1001, 30000), -1);
  constexpr std::int64_t kLargest = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ((TimeBase{1, 1'000'000'000}.tickAt(kLargest, 1)), kLargest);
  EXPECT_EQ((TimeBase{1, 1'000'000'000}.tickAt(-kLargest, 1)), std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ((TimeBase{1, 1'000'000'000}.tickAt(kLargest, kLargest)), 1'000'000'000);
}

class SourceOfTimes : public PacketSource {
 public:
  explicit SourceOfTimes(const std::vector<std::int64_t>& times) {
    for (const std::int64_t time : times) headers_.emplace_back().time = time;
  }
  std::uint64_t frameCount() const override { return headers_.size(); }
  const FrameHeader& header(std::uint64_t frame) const override { return headers_[frame]; }
  Result<Bytes> packet(std::uint64_t) override { return {ErrorCode::kNotFound, "none"}; }

 private:
  std::vector<FrameHeader> headers_;
};

TEST(Times, TheFrameThatIsShown) {
  const SourceOfTimes uneven({-7, 0, 1, 100});
  EXPECT_EQ(frameAt(uneven, -8), std::nullopt);
  EXPECT_EQ(frameAt(uneven, -7), 0u);
  EXPECT_EQ(frameAt(uneven, -1), 0u);
  EXPECT_EQ(frameAt(uneven, 0), 1u);
  EXPECT_EQ(frameAt(uneven, 99), 2u);
  EXPECT_EQ(frameAt(uneven, 1'000'000), 3u);
  EXPECT_EQ(frameAt(SourceOfTimes({}), 0), std::nullopt);
}

}  // namespace
}  // namespace isoreel
