// SPDX-License-Identifier: BSD-3-Clause
#include "enc_settings.h"

#include <algorithm>
#include <bit>

namespace isoreel::gst {
namespace {

enum Property {
  kIso = 1,
  kInside,
  kStep,
  kCellSide,
  kGop,
  kProfile,
  kFrameTypes,
  kBlock,
  kSearch,
  kRegistration,
  kPreset,
  kVertex,
  kFit,
  kSlices,
  kNan,
  kJobs
};

constexpr gint kInsideAuto = -1;

const GEnumValue kInsides[] = {{kInsideAuto, "below for level sets, else above", "auto"},
                               {static_cast<gint>(Inside::kBelow), "Samples below the isovalue", "below"},
                               {static_cast<gint>(Inside::kAbove), "Samples above the isovalue", "above"},
                               {0, nullptr, nullptr}};
const GEnumValue kProfiles[] = {
    {static_cast<gint>(Profile::kClassic), "Tools of the 2006 paper", "classic"},
    {static_cast<gint>(Profile::kMain), "One height a vertex, for the mesh", "main"},
    {0, nullptr, nullptr}};
const GEnumValue kTypes[] = {
    {static_cast<gint>(FrameTypes::kIntra), "Every frame decodes alone", "intra"},
    {static_cast<gint>(FrameTypes::kAuto), "Predicted where that is smaller", "auto"},
    {0, nullptr, nullptr}};
const GEnumValue kBlocks[] = {{0, "8, 16 or 32 cells, whichever is smallest", "any"},
                              {2, "4 cells", "4"},
                              {3, "8 cells", "8"},
                              {4, "16 cells", "16"},
                              {5, "32 cells", "32"},
                              {0, nullptr, nullptr}};
const GEnumValue kPresets[] = {
    {static_cast<gint>(Preset::kFast), "0.9 of the time, packets a little larger", "fast"},
    {static_cast<gint>(Preset::kDefault), "As what is not set otherwise", "default"},
    {static_cast<gint>(Preset::kBest), "Twice the time: tries several sizes of blocks", "best"},
    {0, nullptr, nullptr}};
const GEnumValue kFits[] = {{static_cast<gint>(Fit::kVolume), "The volume's isosurface", "volume"},
                            {static_cast<gint>(Fit::kExtracted), "The extractor's mesh", "extracted"},
                            {0, nullptr, nullptr}};
const GEnumValue kVertices[] = {
    {static_cast<gint>(VertexPlacement::kQef), "Least squares of planes", "qef"},
    {static_cast<gint>(VertexPlacement::kCentroid), "Mean of crossings", "centroid"},
    {0, nullptr, nullptr}};
const GEnumValue kNonFinites[] = {
    {static_cast<gint>(NonFinite::kRefuse), "An error that names the sample", "error"},
    {static_cast<gint>(NonFinite::kOutside), "Outside", "outside"},
    {0, nullptr, nullptr}};

constexpr auto kFlags =
    static_cast<GParamFlags>(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_READY);

}  // namespace

EncoderProperties::EncoderProperties() { settings.frame_types = FrameTypes::kAuto; }

EncoderSettings EncoderProperties::chosen() const {
  EncoderSettings result = settings;
  usePreset(preset, result);
  if (block_log2) result.motion.block_log2 = *block_log2;
  if (search) result.motion.range = *search;
  return result;
}

void EncoderProperties::install(GObjectClass* klass) {
  const auto choice = [&](guint id, const char* name, const char* nick, const char* blurb, const char* type,
                          const GEnumValue* values, gint preset) {
    g_object_class_install_property(
        klass, id,
        g_param_spec_enum(name, nick, blurb, g_enum_register_static(type, values), preset, kFlags));
  };
  const EncoderProperties preset;
  const EncoderSettings settings = preset.chosen();
  g_object_class_install_property(
      klass, kIso,
      g_param_spec_string(
          "iso", "Isovalue",
          "Isovalue, or one a volume: V,V,... (none: what comes with the volumes, or 0 for level sets)", "",
          kFlags));
  choice(kInside, "inside", "Inside", "Side of the isovalue that is inside", "GstIsoreelInside", kInsides,
         kInsideAuto);
  g_object_class_install_property(
      klass, kStep,
      gst_param_spec_fraction("step", "Step", "Quantiser step of vertices, as a part of a cell", 1, kCell, 1,
                              1, 1, 16, kFlags));
  g_object_class_install_property(
      klass, kCellSide,
      g_param_spec_double("cell", "Cell", "Side of a coded cell, in cells of the volumes", 1, kMaxCell,
                          settings.cell, kFlags));
  g_object_class_install_property(
      klass, kGop,
      g_param_spec_uint("gop", "GOP", "Frames from one that decodes alone to the next, at most", 1, 1u << 20,
                        settings.gop, kFlags));
  choice(kProfile, "profile", "Profile", "Coding tools", "GstIsoreelProfile", kProfiles,
         static_cast<gint>(settings.configuration.profile));
  choice(kFrameTypes, "frame-types", "Frame types",
         "Predict frames from those before them where that is smaller, or none", "GstIsoreelFrameTypes",
         kTypes, static_cast<gint>(settings.frame_types));
  choice(kPreset, "preset", "Preset", "How much time to take; sets block and search where those are not set",
         "GstIsoreelPreset", kPresets, static_cast<gint>(preset.preset));
  choice(kBlock, "block", "Block", "Side of the blocks that move", "GstIsoreelBlock", kBlocks,
         static_cast<gint>(settings.motion.block_log2));
  g_object_class_install_property(
      klass, kSearch,
      g_param_spec_uint("search", "Search",
                        "Range of the coarse motion search around what neighbours say, in cells; 0: none", 0,
                        64, settings.motion.range, kFlags));
  g_object_class_install_property(klass, kRegistration,
                                  g_param_spec_boolean("registration", "Registration",
                                                       "Refine motion by registration to the frame before",
                                                       settings.motion.registration, kFlags));
  choice(kVertex, "vertex", "Vertex", "Vertex of a cell: least squares of planes, or mean of crossings",
         "GstIsoreelVertex", kVertices, static_cast<gint>(settings.placement));
  choice(kFit, "fit", "Fit", "What surfaces come close to (profile main)", "GstIsoreelFit", kFits,
         static_cast<gint>(settings.heights.fit));
  g_object_class_install_property(
      klass, kSlices,
      g_param_spec_uint("slices", "Slices",
                        "Parts that large frames are coded in, so that as many threads can decode one", 1,
                        Slices::kMost, settings.configuration.slices.most, kFlags));
  choice(kNan, "nan", "Not a number", "Samples that are not finite: an error, or outside", "GstIsoreelNan",
         kNonFinites, static_cast<gint>(settings.non_finite));
  g_object_class_install_property(
      klass, kJobs,
      g_param_spec_int("jobs", "Jobs", "Threads for a frame; 0: one a core", 0, 256, 0, kFlags));
}

void EncoderProperties::set(GObject* object, guint id, const GValue* value, GParamSpec* spec) {
  switch (id) {
    case kIso:
      isovalues = g_value_get_string(value) != nullptr ? g_value_get_string(value) : "";
      break;
    case kInside:
      inside.reset();
      if (const gint side = g_value_get_enum(value); side != kInsideAuto) inside = static_cast<Inside>(side);
      break;
    case kStep: {
      const gint64 up = gint64{gst_value_get_fraction_numerator(value)} * kCell;
      const gint64 down = gst_value_get_fraction_denominator(value);
      settings.configuration.step =
          static_cast<std::uint32_t>(std::clamp<gint64>((up + down / 2) / down, 1, kCell));
      break;
    }
    case kGop:
      settings.gop = g_value_get_uint(value);
      break;
    case kProfile:
      settings.configuration.profile = static_cast<Profile>(g_value_get_enum(value));
      break;
    case kFrameTypes:
      settings.frame_types = static_cast<FrameTypes>(g_value_get_enum(value));
      break;
    case kBlock:
      block_log2 = static_cast<std::uint32_t>(g_value_get_enum(value));
      break;
    case kSearch:
      search = g_value_get_uint(value);
      break;
    case kRegistration:
      settings.motion.registration = g_value_get_boolean(value) != FALSE;
      break;
    case kPreset:
      preset = static_cast<Preset>(g_value_get_enum(value));
      break;
    case kFit:
      settings.heights.fit = static_cast<Fit>(g_value_get_enum(value));
      break;
    case kCellSide:
      settings.cell = g_value_get_double(value);
      break;
    case kSlices:
      settings.configuration.slices.most = g_value_get_uint(value);
      break;
    case kVertex:
      settings.placement = static_cast<VertexPlacement>(g_value_get_enum(value));
      break;
    case kNan:
      settings.non_finite = static_cast<NonFinite>(g_value_get_enum(value));
      break;
    case kJobs:
      jobs = g_value_get_int(value);
      break;
    default:
      G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
}

void EncoderProperties::get(GObject* object, guint id, GValue* value, GParamSpec* spec) const {
  switch (id) {
    case kIso:
      g_value_set_string(value, isovalues.c_str());
      break;
    case kInside:
      g_value_set_enum(value, inside ? static_cast<gint>(*inside) : kInsideAuto);
      break;
    case kStep:
      gst_value_set_fraction(value, static_cast<gint>(settings.configuration.step), kCell);
      break;
    case kGop:
      g_value_set_uint(value, settings.gop);
      break;
    case kProfile:
      g_value_set_enum(value, static_cast<gint>(settings.configuration.profile));
      break;
    case kFrameTypes:
      g_value_set_enum(value, static_cast<gint>(settings.frame_types));
      break;
    case kBlock:
      g_value_set_enum(value, static_cast<gint>(chosen().motion.block_log2));
      break;
    case kSearch:
      g_value_set_uint(value, chosen().motion.range);
      break;
    case kRegistration:
      g_value_set_boolean(value, settings.motion.registration);
      break;
    case kPreset:
      g_value_set_enum(value, static_cast<gint>(preset));
      break;
    case kFit:
      g_value_set_enum(value, static_cast<gint>(settings.heights.fit));
      break;
    case kCellSide:
      g_value_set_double(value, settings.cell);
      break;
    case kSlices:
      g_value_set_uint(value, settings.configuration.slices.most);
      break;
    case kVertex:
      g_value_set_enum(value, static_cast<gint>(settings.placement));
      break;
    case kNan:
      g_value_set_enum(value, static_cast<gint>(settings.non_finite));
      break;
    case kJobs:
      g_value_set_int(value, jobs);
      break;
    default:
      G_OBJECT_WARN_INVALID_PROPERTY_ID(object, id, spec);
  }
}

}  // namespace isoreel::gst
