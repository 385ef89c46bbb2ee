// SPDX-License-Identifier: BSD-3-Clause
// VDB files that OpenVDB itself writes. Each type of grid whose template is named here takes ten seconds to
// compile, so grids of doubles come from a file, as what every grid derives from.
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include <cmath>
#include <stdexcept>

#include "support.h"

namespace isoreel::io {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

class OpenVdb : public IoTest {
 protected:
  OpenVdb() { openvdb::initialize(); }

  // Active where its box is, with values that tell the voxels apart.
  static openvdb::FloatGrid::Ptr grid(const std::string& name, const CoordBBox& box, float background = 9,
                                      openvdb::GridClass kind = openvdb::GRID_LEVEL_SET) {
    auto result = openvdb::FloatGrid::create(background);
    result->setName(name);
    result->setGridClass(kind);
    auto accessor = result->getAccessor();
    for (auto c = box.begin(); c; ++c) accessor.setValue(*c, static_cast<float>(value(*c)));
    return result;
  }
  // The same of doubles, where kDoubles is.
  static openvdb::GridBase::Ptr doubles(const std::string& name) {
    openvdb::io::File file(ISOREEL_IO_DATA "/openvdb/double.vdb");
    file.open(false);
    const auto result = file.readGrid("phi");
    result->setName(name);
    return result;
  }
  static double value(const Coord& c) { return 0.5 * c.x() + 4 * c.y() - 16 * c.z(); }

  void save(const std::string& name, const openvdb::GridPtrVec& grids, bool stats = true) const {
    openvdb::io::File file(path(name));
    file.setGridStatsMetadataEnabled(stats);
    file.write(grids);
    file.close();
  }
  std::unique_ptr<VolumeSequence> open(const std::vector<std::string>& names,
                                       const std::string& gridName = "") const {
    std::vector<std::string> paths;
    for (const std::string& name : names) paths.push_back(path(name));
    auto sequence = openVolumes(paths, {gridName});
    if (!sequence.ok()) throw std::runtime_error(sequence.error().message);  // GoogleTest reports it
    return *std::move(sequence);
  }
};

// The box of the grid in double.vdb.
const CoordBBox kDoubles(Coord(1, 8, -16), Coord(5, 13, -10));

TEST_F(OpenVdb, EverySampleOfTheActiveBox) {
  const CoordBBox floats(Coord(-3, 5, -20), Coord(9, 17, 2));
  for (const CoordBBox& box : {floats, kDoubles}) {
    for (const bool stats : {true, false}) {
      for (const bool half : {true, false}) {
        const openvdb::GridBase::Ptr written = box == kDoubles ? doubles("phi") : grid("phi", box);
        ASSERT_EQ(written->valueType(), box == kDoubles ? "double" : "float");
        written->setSaveFloatAsHalf(half);
        save("a.vdb", {written}, stats);
        const auto sequence = open({"a.vdb"});
        EXPECT_TRUE(sequence->levelSet());
        const auto volume = sequence->read(0);
        ASSERT_TRUE(volume.ok()) << volume.error().message;
        for (std::size_t a = 0; a < 3; ++a)
          ASSERT_EQ(volume->grid.nodes[a], static_cast<unsigned>(box.dim()[a]));
        for (auto c = box.begin(); c; ++c) {
          const Coord at = *c - box.min();
          ASSERT_EQ(volume->at(static_cast<unsigned>(at.x()), static_cast<unsigned>(at.y()),
                               static_cast<unsigned>(at.z())),
                    static_cast<float>(value(*c)));
        }
      }
    }
  }
}

TEST_F(OpenVdb, BoxIsTheUnionAndTheRestIsTheTrees) {
  auto a = grid("phi", CoordBBox(Coord(0, 0, 0), Coord(0, 0, 0)));
  auto b = grid("phi", CoordBBox(Coord(20, 3, 4), Coord(20, 3, 4)), 7);
  b->tree().addTile(1, Coord(8, 0, 0), -7, false);  // inside, inactive, 8 voxels wide
  save("a.vdb", {a});
  save("b.vdb", {b});
  const auto sequence = open({"a.vdb", "b.vdb"});
  ASSERT_EQ(sequence->grid().nodes, (std::array<std::uint32_t, 3>{21, 4, 5}));
  const Volume first = *sequence->read(0), second = *sequence->read(1);
  EXPECT_EQ(first.at(0, 0, 0), 0);
  EXPECT_EQ(first.at(20, 3, 4), 9);
  EXPECT_EQ(second.at(0, 0, 0), 7);
  EXPECT_EQ(second.at(8, 0, 0), -7);
  EXPECT_EQ(second.at(15, 3, 4), -7);
  EXPECT_EQ(second.at(16, 3, 4), 7);
  EXPECT_EQ(second.at(20, 3, 4), static_cast<float>(value(Coord(20, 3, 4))));
  EXPECT_TRUE(
      contains(errorOf({path("a.vdb")}), path("a.vdb") + ": active voxels span (0, 0, 0) to (0, 0, 0)"));
  save("c.vdb", {openvdb::FloatGrid::create(3)});
  EXPECT_TRUE(contains(errorOf({path("c.vdb")}), "span nothing"));
}

TEST_F(OpenVdb, NotANumberPassesThrough) {
  auto a = grid("phi", CoordBBox(Coord(0, 0, 0), Coord(2, 2, 2)));
  a->tree().setValue(Coord(1, 2, 0), std::nanf(""));
  save("a.vdb", {a});
  EXPECT_TRUE(std::isnan(open({"a.vdb"})->read(0)->at(1, 2, 0)));
}

TEST_F(OpenVdb, WhichGridIsRead) {
  const CoordBBox box(Coord(0, 0, 0), Coord(2, 2, 2));
  const auto vectors = openvdb::Vec3SGrid::create();
  vectors->setName("velocity");
  const auto fog = grid("density", box, 0, openvdb::GRID_FOG_VOLUME);
  const auto surface = grid("surface", CoordBBox(Coord(0, 0, 0), Coord(3, 3, 3)));
  const auto other = doubles("other");

  save("fog.vdb", {vectors, fog});
  EXPECT_FALSE(open({"fog.vdb"})->levelSet());
  save("two.vdb", {vectors, fog, surface});
  EXPECT_EQ(open({"two.vdb"})->grid().nodes[0], 4u);
  EXPECT_EQ(open({"two.vdb"}, "density")->grid().nodes[0], 3u);
  save("three.vdb", {vectors, fog, surface, other});
  const std::string error = errorOf({path("three.vdb")});
  EXPECT_TRUE(contains(error, path("three.vdb") + ": choose a grid by name"));
  for (const char* part : {"velocity (vec3s, ", "density (float, fog volume)", "surface (float, level set)",
                           "other (double, level set)"}) {
    EXPECT_TRUE(contains(error, part));
  }
  EXPECT_EQ(open({"three.vdb"}, "surface")->grid().nodes[0], 4u);
  EXPECT_TRUE(contains(errorOf({path("three.vdb")}, {"phi"}), "no grid \"phi\"; it has density"));
  EXPECT_TRUE(contains(errorOf({path("three.vdb")}, {"velocity"}), "not a float grid"));
  // The first file chooses for all.
  save("surface.vdb", {surface});
  EXPECT_TRUE(
      contains(errorOf({path("surface.vdb"), path("fog.vdb")}), path("fog.vdb") + ": no grid \"surface\""));
  save("vectors.vdb", {vectors});
  EXPECT_TRUE(contains(errorOf({path("vectors.vdb")}), "no float grid"));
  save("none.vdb", {});
  EXPECT_TRUE(contains(errorOf({path("none.vdb")}), "it has none"));
}

TEST_F(OpenVdb, Placement) {
  const CoordBBox box(Coord(10, 20, 30), Coord(12, 22, 32));
  openvdb::Mat4d matrix = openvdb::Mat4d::identity();
  matrix.preScale(openvdb::Vec3d(0.5, 0.25, 2));
  matrix.postRotate(openvdb::math::Z_AXIS, 0.5);
  matrix.postTranslate(openvdb::Vec3d(100, -7, 3));
  const auto a = grid("phi", box);
  a->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  save("a.vdb", {a});
  const auto sequence = open({"a.vdb"});
  EXPECT_NEAR(sequence->grid().spacing[1], 0.25, 1e-12);
  for (const Coord offset :
       {Coord(0, 0, 0), Coord(1, 0, 0), Coord(0, 1, 0), Coord(0, 0, 1), Coord(2, 1, 2)}) {
    const openvdb::Vec3d expected = a->transform().indexToWorld(box.min() + offset);
    const Vec3d found =
        sequence->grid().world(Vec3d{double(offset.x()), double(offset.y()), double(offset.z())});
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(found[static_cast<std::size_t>(i)], expected[i], 1e-9);
  }
}

TEST_F(OpenVdb, PlacementsThatDifferOrBend) {
  const auto a = grid("phi", CoordBBox(Coord(0, 0, 0), Coord(9, 9, 9)));
  save("a.vdb", {a});
  a->setTransform(openvdb::math::Transform::createLinearTransform(1.001));
  save("b.vdb", {a});
  const std::string error = errorOf({path("a.vdb"), path("b.vdb")});
  EXPECT_TRUE(contains(error, path("a.vdb")));
  EXPECT_TRUE(contains(error, path("b.vdb")));
  a->setTransform(
      openvdb::math::Transform::createFrustumTransform(openvdb::BBoxd({0, 0, 0}, {10, 10, 10}), 0.5, 10, 1));
  save("c.vdb", {a});
  EXPECT_TRUE(contains(errorOf({path("c.vdb")}), "only linear"));
}

TEST_F(OpenVdb, EveryCutIsAnError) {
  save("a.vdb", {grid("phi", CoordBBox(Coord(0, 0, 0), Coord(9, 9, 9)))});
  const std::string whole = content("a.vdb");
  for (std::size_t size = 0; size < whole.size(); size += size < 1000 ? 1 : 37) {
    write("x.vdb", whole.substr(0, size));
    EXPECT_TRUE(contains(errorOf({path("x.vdb")}), path("x.vdb"))) << size;
  }
  EXPECT_EQ(errorOf({path("a.vdb")}), "");
}

TEST_F(OpenVdb, MetadataThatLies) {
  const CoordBBox box(Coord(0, 0, 0), Coord(3, 3, 3));
  auto lie = [&](const Coord& max) {
    auto a = grid("phi", box);
    a->insertMeta("file_bbox_min", openvdb::Vec3IMetadata(openvdb::Vec3i(0, 0, 0)));
    a->insertMeta("file_bbox_max", openvdb::Vec3IMetadata(max.asVec3i()));
    save("a.vdb", {a}, /*stats=*/false);
    return errorOf({path("a.vdb")});
  };
  EXPECT_TRUE(contains(lie(Coord(2, 2, 2)), "its metadata says (0, 0, 0) to (2, 2, 2)"));
  EXPECT_TRUE(contains(lie(Coord(60000, 60000, 60000)), "too much for files of"));
  EXPECT_TRUE(contains(lie(Coord(2000000000, 3, 3)), "2 to 65536 nodes a side"));
  EXPECT_EQ(lie(Coord(5, 3, 3)), "");
}

// Every length up to the counts in the tree's root, set to a lot: none may crash, hang or allocate. (Below
// the root lengths are OpenVDB's: it asks for what they say and throws when it cannot be had, where
// AddressSanitizer stops.)
TEST_F(OpenVdb, LengthsThatLie) {
  save("a.vdb", {grid("phi", CoordBBox(Coord(0, 0, 0), Coord(9, 9, 9)))});
  const std::string whole = content("a.vdb"), map = "UniformScaleMap";
  const std::size_t root = whole.find(map) + map.size() + 5 * 24 + 4 + 4;
  ASSERT_LT(root + 8, whole.size());
  EXPECT_EQ(whole[root + 4], 1);  // one child: the place is right
  std::size_t errors = 0;
  for (std::size_t i = 8; i <= root - 4; ++i) {
    std::string broken = whole;
    broken.replace(i, 4, "\xff\xff\xff\x7f");
    write("x.vdb", broken);
    const std::string error = errorOf({path("x.vdb")});
    if (!error.empty()) ++errors;
    EXPECT_TRUE(error.empty() || contains(error, path("x.vdb")));
  }
  EXPECT_GT(errors, 100u);
  for (const std::size_t count : {root, root + 4}) {
    std::string broken = whole;
    broken.replace(count, 4, "\xff\xff\xff\xff");
    write("x.vdb", broken);
    EXPECT_TRUE(contains(errorOf({path("x.vdb")}), "its root counts"));
  }
}

}  // namespace
}  // namespace isoreel::io
