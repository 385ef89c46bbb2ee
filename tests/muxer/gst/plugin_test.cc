// SPDX-License-Identifier: BSD-3-Clause
#include <gst/gst.h>
#include <gtest/gtest.h>

namespace {

TEST(Plugin, isFound) {
  GstPlugin* plugin = gst_registry_find_plugin(gst_registry_get(), "isoreel");
  ASSERT_NE(plugin, nullptr);
  EXPECT_STREQ(gst_plugin_get_license(plugin), "BSD");
  gst_object_unref(plugin);
}

}  // namespace
