// SPDX-License-Identifier: BSD-3-Clause
// The encoder's properties: the command line's options of the same names.
#pragma once

#include <gst/gst.h>
#include <isoreel/codec/encoder.h>

#include <optional>
#include <string>

namespace isoreel::gst {

struct EncoderProperties {
  EncoderSettings settings;  // but for grid, inside, time base and threads
  std::string isovalues;
  std::optional<Inside> inside;
  int jobs = 0;

  EncoderProperties();
  static void install(GObjectClass* klass);
  void set(GObject* object, guint id, const GValue* value, GParamSpec* spec);
  void get(GObject* object, guint id, GValue* value, GParamSpec* spec) const;
};

}  // namespace isoreel::gst
