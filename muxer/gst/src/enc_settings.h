// SPDX-License-Identifier: BSD-3-Clause
// The encoder's properties: the command line's options of the same names.
#pragma once

#include <gst/gst.h>
#include <isoreel/codec/encoder.h>

#include <optional>
#include <string>

namespace isoreel::gst {

struct EncoderProperties {
  EncoderSettings settings;  // without what the preset sets
  Preset preset = Preset::kDefault;
  std::optional<std::uint32_t> block_log2, search;  // against the preset
  std::string isovalues;
  std::optional<Inside> inside;
  int jobs = 0;

  EncoderProperties();
  /// All settings but grid, inside, time base and threads.
  EncoderSettings chosen() const;
  static void install(GObjectClass* klass);
  void set(GObject* object, guint id, const GValue* value, GParamSpec* spec);
  void get(GObject* object, guint id, GValue* value, GParamSpec* spec) const;
};

}  // namespace isoreel::gst
