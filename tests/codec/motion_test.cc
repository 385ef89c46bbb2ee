// SPDX-License-Identifier: BSD-3-Clause
// What an encoder with prediction writes, and what a decoder makes of it; the distance that the search
// registers to.
#include <gtest/gtest.h>

#include <cmath>

#include "extract/sign_bitmap.h"
#include "inter/reference.h"
#include "made.h"
#include "motion/signed_distance.h"
#include "packets.h"

namespace isoreel {
namespace {

/// Frames 0, 1, … of a moving field.
struct Sequence {
  std::string name;
  Grid grid;
  std::size_t frames = 0;
  std::function<made::Field(double)> at;
  std::uint32_t step = kCell / 16;

  made::Made frame(std::size_t t) const { return {name, made::sampled(grid, at(static_cast<double>(t)))}; }
};

EncoderSettings predicting(const Sequence& sequence, std::uint32_t gop = 1000) {
  EncoderSettings settings = made::settings(sequence.frame(0), sequence.step);
  settings.frame_types = FrameTypes::kAuto;
  settings.gop = gop;
  return settings;
}

std::vector<Packet> encoded(const Sequence& sequence, const EncoderSettings& settings) {
  auto encoder = Encoder::create(settings);
  std::vector<Packet> packets;
  for (std::size_t t = 0; t < sequence.frames; ++t) {
    auto packet = encoder->encode(sequence.frame(t).volume, {t, static_cast<std::int64_t>(t), 1, 0});
    EXPECT_TRUE(packet.ok());
    packets.push_back(*std::move(packet));
  }
  return packets;
}

std::string types(const std::vector<Packet>& packets) {
  std::string result;
  for (const Packet& packet : packets) result += packet.header.type == PacketType::kIntra ? 'I' : 'P';
  return result;
}

made::Field both(const made::Field& a, const made::Field& b) {
  return [=](double x, double y, double z) { return std::min(a(x, y, z), b(x, y, z)); };
}

std::vector<Sequence> sequences() {
  using made::sphere;
  return {
      {"translated", made::gridOf(25, 24, 23), 7,
       [](double t) { return sphere(9 + 0.7 * t, 10 + 0.4 * t, 11.3 - 0.5 * t, 7.2); }},
      {"fine steps", made::gridOf(17, 16, 15), 3,
       [](double t) { return sphere(7 + 0.7 * t, 7 + 0.4 * t, 7.3 - 0.5 * t, 5.2); }, 16},
      {"coarse steps", made::gridOf(17, 16, 15), 3,
       [](double t) { return sphere(7 + 0.7 * t, 7 + 0.4 * t, 7.3 - 0.5 * t, 5.2); }, kCell},
      {"merge and split", made::gridOf(36, 17, 16), 8,
       [](double t) {
         const double apart = 5 + 0.9 * std::abs(t - 3.5);
         return both(sphere(17.5 - apart, 8, 7.5, 5.2), sphere(17.5 + apart, 8.3, 7.8, 5.6));
       }},
      {"appear and vanish", made::gridOf(40, 15, 16), 6,
       [](double t) {
         return both(sphere(9 + 0.5 * t, 7, 7.4, t < 4 ? 5.3 : -1),
                     sphere(29 - 0.3 * t, 7, 7.8, t < 2 ? -1 : 2 + 0.9 * t));
       }},
      {"to and from nothing", made::gridOf(15, 14, 16), 7,
       [](double t) { return sphere(7, 6.5, 7.5, t == 0 || t == 3 || t == 4 ? -1 : 5 + 0.1 * t); }},
      {"full", made::gridOf(15, 14, 16), 3, [](double t) { return sphere(7, 6.5, 7.5, t == 1 ? 50 : 5.1); }},
      {"cut by the border", made::gridOf(20, 17, 9), 4,
       [](double t) { return sphere(2.2 + 4.1 * t, 8 - 0.6 * t, 4, 5.7); }},
      {"noise", made::gridOf(13, 12, 11), 4,
       [](double t) {
         return [t](double x, double y, double z) {
           return std::sin(12.9898 * x + 78.233 * y + 37.719 * z + 0.05 * t) + 0.3 * std::sin(2.1 * x + t);
         };
       }},
      {"smallest grid", made::gridOf(2, 2, 2), 4,
       [](double t) { return [t](double x, double y, double z) { return x + y + z - 0.5 - 0.1 * t; }; }},
  };
}

TEST(Predicted, DecodesAsEncodedInOrderAndFromEveryKey) {
  std::size_t predicted = 0;
  for (const Sequence& sequence : sequences()) {
    SCOPED_TRACE(sequence.name);
    const auto packets = encoded(sequence, predicting(sequence, 5));
    made::Random random(7);
    Decoder decoder;
    for (std::size_t t = 0; t < packets.size(); ++t) {
      const auto surface = decoder.decode(packets[t].data);
      ASSERT_TRUE(surface.ok()) << t << ": " << surface.error().message;
      EXPECT_EQ(surfaceHash(*surface), packets[t].header.surface_hash);
      EXPECT_TRUE(checkClosed(*surface).ok());
      predicted += packets[t].header.type == PacketType::kPredicted;
    }
    Decoder seeking;
    for (int seek = 0; seek < 6; ++seek) {
      const std::size_t wanted = random() % packets.size();
      for (std::size_t t = wanted - packets[wanted].header.back; t <= wanted; ++t) {
        const auto surface = seeking.decode(packets[t].data);
        ASSERT_TRUE(surface.ok()) << surface.error().message;
        EXPECT_EQ(surfaceHash(*surface), packets[t].header.surface_hash);
      }
    }
  }
  EXPECT_GT(predicted, 20u);
}

TEST(Predicted, KeepsTheSignsAndStaysWithinTheStep) {
  for (const Sequence& sequence : sequences()) {
    SCOPED_TRACE(sequence.name);
    const auto packets = encoded(sequence, predicting(sequence));
    Decoder decoder;
    for (std::size_t t = 0; t < packets.size(); ++t) {
      const made::Made m = sequence.frame(t);
      const auto surface = decoder.decode(packets[t].data);
      ASSERT_TRUE(surface.ok());
      const Surface exact = made::extracted(m);
      ASSERT_EQ(surface->quads, exact.quads);
      // Levels are centroids of what they stand for, so at most a step away along the normal; half a step
      // along the tangents.
      const double tangential = readPacketHeader(packets[t].data)->tangential_step;
      const double farthest =
          std::sqrt(1.0 * sequence.step * sequence.step + 0.5 * tangential * tangential) + 4;
      for (std::size_t i = 0; i < surface->vertices.size(); ++i) {
        double square = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const double error = surface->vertices[i][k] - exact.vertices[i][k];
          square += error * error;
        }
        ASSERT_LE(std::sqrt(square), farthest) << "frame " << t << ", vertex " << i;
      }
    }
  }
}

/// Sizes of the last frame of a moving sphere: predicted, and by itself.
std::array<std::size_t, 2> lastSizes(const std::array<double, 3>& motion, std::uint32_t block_log2) {
  const Sequence sequence{
      "sphere", made::gridOf(49, 49, 49), 3,
      [&](double t) { return made::sphere(18 + motion[0] * t, 20 + motion[1] * t, 26 + motion[2] * t, 15); }};
  EncoderSettings settings = predicting(sequence);
  settings.motion.block_log2 = block_log2;
  const auto packets = encoded(sequence, settings);
  EXPECT_EQ(types(packets), "IPP");
  settings.frame_types = FrameTypes::kIntra;
  return {packets[2].data.size(), encoded(sequence, settings)[2].data.size()};
}

TEST(Predicted, TranslatedSphereTakesAThirdOrLess) {
  // Bounds are about 5 % above what was measured, for slow, fast and whole motion. Of the bytes of blocks of
  // 8 cells, vectors take about a quarter.
  for (const auto& [block_log2, bounds] :
       {std::pair{3u, std::array{0.323, 0.383, 0.268}}, {4u, std::array{0.259, 0.306, 0.195}}}) {
    const std::array sizes{lastSizes({0.4, 0.3, -0.2}, block_log2), lastSizes({4.3, 3.2, -2.2}, block_log2),
                           lastSizes({1, 0, 0}, block_log2)};
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      EXPECT_LT(static_cast<double>(sizes[i][0]), bounds[i] * static_cast<double>(sizes[i][1]))
          << i << ", blocks of 2^" << block_log2 << ": " << sizes[i][0] << " of " << sizes[i][1];
    }
  }
}

TEST(Predicted, SearchAndRegistrationEachHelp) {
  const Sequence sequence{"fast", made::gridOf(33, 25, 25), 2,
                          [](double t) { return made::sphere(11 + 6.4 * t, 12.1 + t, 12.3, 8.4); }};
  const auto size = [&](std::uint32_t range, bool registration) {
    EncoderSettings settings = predicting(sequence);
    settings.motion.range = range;
    settings.motion.registration = registration;
    return encoded(sequence, settings)[1].data.size();
  };
  const std::size_t with_both = size(8, true);
  EXPECT_LT(with_both, size(0, true)) << "registration alone finds no way over six cells";
  EXPECT_LT(with_both, size(8, false)) << "the search alone stops at half cells";
}

TEST(Predicted, LongGroupNeitherDriftsNorFails) {
  const Sequence sequence{"small", made::gridOf(11, 11, 11), 1000,
                          [](double t) { return made::sphere(5 + 0.0006 * t, 5.2 - 0.0004 * t, 4.9, 3.9); }};
  auto encoder = Encoder::create(predicting(sequence));
  Decoder decoder;
  double first = 0;
  for (std::size_t t = 0; t < sequence.frames; ++t) {
    const auto packet = encoder->encode(sequence.frame(t).volume, {t, 0, 1, 0});
    ASSERT_TRUE(packet.ok());
    ASSERT_EQ(packet->header.type == PacketType::kIntra, t == 0) << t;
    const auto surface = decoder.decode(packet->data);
    ASSERT_TRUE(surface.ok()) << t << ": " << surface.error().message;
    if (t == 0) first = packet->header.error_rms;
    ASSERT_LE(packet->header.error_rms, 1.5 * first) << t;
    // A step along the normal, half a step along each tangent.
    const PacketHeader header = *readPacketHeader(packet->data);
    const double step = header.step / double{kCell}, tangential = header.tangential_step / double{kCell};
    ASSERT_LE(packet->header.error_max, std::sqrt(step * step + 0.5 * tangential * tangential) + 0.001) << t;
  }
}

TEST(Predicted, SameBytesWhateverTheThreads) {
  for (const Sequence& sequence : sequences()) {
    EncoderSettings settings = predicting(sequence);
    const auto serial = encoded(sequence, settings);
    settings.parallel = made::threadedFor;
    const auto threaded = encoded(sequence, settings);
    for (std::size_t t = 0; t < serial.size(); ++t) {
      EXPECT_EQ(serial[t].data, threaded[t].data) << sequence.name << " frame " << t;
      EXPECT_EQ(serial[t].header, threaded[t].header);
    }
  }
}

TEST(Predicted, SameBytesWhenFramesArePreparedAhead) {
  for (const Profile profile : {Profile::kClassic, Profile::kMain}) {
    for (const Sequence& sequence : sequences()) {
      EncoderSettings settings = predicting(sequence);
      settings.configuration.profile = profile;
      const auto serial = encoded(sequence, settings);
      auto encoder = Encoder::create(settings);
      const auto timing = [](std::size_t t) { return FrameTiming{t, static_cast<std::int64_t>(t), 1, 0}; };
      std::array<PreparedFrame, 2> frames;
      std::array<made::Made, 2> volumes{sequence.frame(0), {}};
      ASSERT_TRUE(encoder->prepare(volumes[0].volume, timing(0), frames[0]).ok());
      for (std::size_t t = 0; t < sequence.frames; ++t) {
        // The next one while this one is coded.
        made::threadedFor(2, [&](std::size_t i) {
          if (i == 0) {
            const auto packet = encoder->encode(frames[t % 2]);
            EXPECT_EQ(packet->data, serial[t].data) << sequence.name << " frame " << t;
            EXPECT_EQ(packet->header, serial[t].header);
          } else if (t + 1 < sequence.frames) {
            volumes[(t + 1) % 2] = sequence.frame(t + 1);
            EXPECT_TRUE(
                encoder->prepare(volumes[(t + 1) % 2].volume, timing(t + 1), frames[(t + 1) % 2]).ok());
          }
        });
      }
    }
  }
}

TEST(FrameTypes, FollowTheGroupLimitAndTheNumbers) {
  Sequence sequence = sequences()[0];
  sequence.frames = 8;
  EXPECT_EQ(types(encoded(sequence, predicting(sequence, 3))), "IPPIPPIP");
  EXPECT_EQ(types(encoded(sequence, predicting(sequence, 1))), "IIIIIIII");
  EXPECT_EQ(types(encoded(sequence, predicting(sequence, 8))), "IPPPPPPP");
  EncoderSettings settings = predicting(sequence);
  settings.frame_types = FrameTypes::kIntra;
  EXPECT_EQ(types(encoded(sequence, settings)), "IIIIIIII");

  auto encoder = Encoder::create(predicting(sequence));
  std::string gaps;
  for (const std::uint64_t number : {4u, 5u, 7u, 8u, 8u, 9u}) {
    const auto packet = encoder->encode(sequence.frame(0).volume, {number, 0, 1, 0});
    gaps += packet->header.type == PacketType::kIntra ? 'I' : 'P';
  }
  EXPECT_EQ(gaps, "IPIPIP") << "a P packet only where the number before was coded last";
}

TEST(FrameTypes, SceneChangeIsAnIntraPacket) {
  const made::Field waves = [](double x, double y, double z) {
    return std::sin(1.1 * x) + std::sin(1.2 * y) + std::sin(0.9 * z + 0.2 * x);
  };
  const made::Field noise = [](double x, double y, double z) {
    return std::sin(12.9 * x * x + 78.2 * y * x + 37.7 * z * y);
  };
  for (const auto& [next, expected] : {std::pair{waves, "IPIP"}, {noise, "IPII"}}) {
    const Sequence sequence{"scenes", made::gridOf(17, 17, 17), 4, [&, next = next](double t) {
                              return t < 2 ? made::sphere(8 + 0.2 * t, 8, 8, 5) : next;
                            }};
    EncoderSettings settings = predicting(sequence);
    const auto packets = encoded(sequence, settings);
    EXPECT_EQ(types(packets), expected) << "what is the same but has no smooth distances is not predicted";
    EXPECT_EQ(packets[3].header.back, expected == std::string("IPIP") ? 1u : 0u);
    // P packets save bytes, and not by being worse.
    settings.frame_types = FrameTypes::kIntra;
    const auto by_itself = encoded(sequence, settings);
    for (std::size_t t = 0; t < packets.size(); ++t) {
      EXPECT_LE(packets[t].data.size(), by_itself[t].data.size()) << t;
      EXPECT_LE(packets[t].header.error_rms, 1.1 * by_itself[t].header.error_rms) << t;
    }
  }
}

TEST(FrameTypes, EncoderGoesOnAfterAnError) {
  const Sequence sequence = sequences()[0];
  auto encoder = Encoder::create(predicting(sequence));
  Decoder decoder;
  ASSERT_TRUE(decoder.decode(encoder->encode(sequence.frame(0).volume, {0, 0, 1, 0})->data).ok());
  EXPECT_FALSE(encoder->encode(made::named("torus").volume, {1, 0, 1, 0}).ok());
  const auto packet = encoder->encode(sequence.frame(1).volume, {1, 0, 1, 0});
  ASSERT_TRUE(packet.ok());
  EXPECT_TRUE(decoder.decode(packet->data).ok());
}

/// The reference that a volume's surface makes.
Reference referenceOf(const made::Made& m) {
  const Surface surface = made::extracted(m);
  const SignBitmap bitmap = *SignBitmap::make(m.volume, m.isovalue, m.inside, NonFinite::kRefuse, serialFor);
  const auto cells = bitmap.activeCells(serialFor);
  Reference reference;
  reference.build(surface, cells);
  return reference;
}

TEST(SignedDistance, IsNearTheSquaredDistance) {
  const Grid grid = made::gridOf(25, 25, 25);
  const made::Field sphere = made::sphere(12, 12.1, 11.8, 8), plane = [](double x, double y, double z) {
    return (x + 0.5 * y - 2 * z + 4.3) / std::sqrt(5.25);
  };
  made::Random random(3);
  const auto place = [&] { return 3.0f + 18.0f * static_cast<float>(random() % 65536) / 65536; };
  for (const auto& [field, tolerance] : {std::pair{plane, 0.04}, std::pair{sphere, 0.15}}) {
    const Reference reference = referenceOf({"shape", made::sampled(grid, field)});
    SignedDistance found(reference.field());
    int close = 0, near = 0;
    double worst = 0, sum = 0;
    for (int trial = 0; trial < 20000; ++trial) {
      const Eigen::Vector3f at(place(), place(), place());
      const double distance = field(at.x(), at.y(), at.z());
      const auto d = found.at(at);
      if (std::abs(distance) < 0.4) {
        ++close;
        near += d.near;
        if (!d.near) continue;
        EXPECT_NEAR(found.square(at, 9), d.value * d.value, 0.001);
        const double error = std::abs(static_cast<double>(d.value * d.value) - distance * distance);
        worst = std::max(worst, error);
        sum += error;
      }
      EXPECT_FALSE(d.near && std::abs(distance) > 4);
    }
    EXPECT_LT(worst, tolerance);
    EXPECT_LT(sum / near, 0.02);
    EXPECT_GT(close, 500);
    EXPECT_GT(near, 0.95 * close) << close;
  }
}

TEST(SignedDistance, IsFarOutsideTheGridAndWithoutASurface) {
  const Reference reference = referenceOf(made::named("sphere")), none = referenceOf(made::named("empty"));
  SignedDistance found(reference.field()), empty(none.field());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float x : {-1e9f, -0.1f, 65535.5f, 3e9f, nan})
    EXPECT_FALSE(found.at(Eigen::Vector3f(x, 16, 16)).near) << x;
  EXPECT_FALSE(empty.at(Eigen::Vector3f(5, 5, 5)).near);
}

}  // namespace
}  // namespace isoreel
