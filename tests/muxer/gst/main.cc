// SPDX-License-Identifier: BSD-3-Clause
// Elements of this build and the few stock ones that the tests use, whatever else is installed: a registry of
// our own.
#include <gst/gst.h>
#include <gtest/gtest.h>

// As in inspect/, which is in the plugin, where LeakSanitizer does not look.
// NOLINTNEXTLINE(bugprone-reserved-identifier, readability-identifier-naming): the name is the sanitizer's
extern "C" const char* __lsan_default_suppressions() { return "leak:libfontconfig"; }

int main(int argc, char** argv) {
  g_setenv("GST_PLUGIN_PATH", ISOREEL_PLUGIN_FOLDER, TRUE);
  g_setenv("GST_PLUGIN_SYSTEM_PATH", STOCK_PLUGIN_FOLDER, TRUE);
  g_setenv("GST_REGISTRY", STOCK_PLUGIN_FOLDER "/registry.bin", TRUE);
  g_setenv("GST_REGISTRY_FORK", "no", TRUE);  // the scanner would have to be built with the same sanitizers
  testing::InitGoogleTest(&argc, argv);
  gst_init(&argc, &argv);
  // GLib's word for a bug of the caller's.
  g_log_set_always_fatal(static_cast<GLogLevelFlags>(G_LOG_LEVEL_CRITICAL | G_LOG_LEVEL_ERROR));
  const int result = RUN_ALL_TESTS();
  gst_deinit();
  return result;
}
