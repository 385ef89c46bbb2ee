// SPDX-License-Identifier: BSD-3-Clause
/**
 * SECTION:element-isoreelvideodec
 *
 * isoreeldec and isoreelrender in one, which players find by themselves, with the properties of both.
 *
 * ## Example
 * |[
 * gst-launch-1.0 playbin uri=file:///tmp/splash.isr
 * gst-launch-1.0 filesrc location=splash.isr ! isoreeldemux ! isoreelvideodec azimuth=60 ! videoconvert !
 * autovideosink
 * ]|
 */
#include "video_dec.h"

#include "common.h"
#include "dec.h"
#include "render.h"

namespace isoreel::gst {
namespace {

struct Element {
  GstBin parent;
  GstElement *decoder, *renderer;  // the bin's
};
struct ElementClass {
  GstBinClass parent;
};

Element* self(gpointer element) { return static_cast<Element*>(element); }

/// The element inside that has this property.
GObject* ownerOf(GObject* bin, GParamSpec* property) {
  GstElement* decoder = self(bin)->decoder;
  const bool decoders = g_object_class_find_property(G_OBJECT_GET_CLASS(decoder), property->name) != nullptr;
  return G_OBJECT(decoders ? decoder : self(bin)->renderer);
}

void setProperty(GObject* bin, guint, const GValue* value, GParamSpec* property) {
  g_object_set_property(ownerOf(bin, property), property->name, value);
}

void getProperty(GObject* bin, guint, GValue* value, GParamSpec* property) {
  g_object_get_property(ownerOf(bin, property), property->name, value);
}

void initClass(ElementClass* klass) {
  GObjectClass* object = G_OBJECT_CLASS(klass);
  object->set_property = setProperty;
  object->get_property = getProperty;
  installDecoderProperties(object);
  installRendererProperties(object);
  GstElementClass* element = GST_ELEMENT_CLASS(klass);
  gst_element_class_set_static_metadata(element, "Isosurface video decoder", "Codec/Decoder/Video",
                                        "Decodes packets of time-varying isosurfaces and draws them",
                                        "Isoreel");
  addTemplate(element, "sink", GST_PAD_SINK, GST_PAD_ALWAYS, kCodedCaps);
  addTemplate(element, "src", GST_PAD_SRC, GST_PAD_ALWAYS, kPictureCaps);
}

void addGhost(Element* element, GstElement* inner, const char* name) {
  GstPad* target = gst_element_get_static_pad(inner, name);
  GstPadTemplate* pads = gst_element_class_get_pad_template(GST_ELEMENT_GET_CLASS(element), name);
  gst_element_add_pad(GST_ELEMENT(element), gst_ghost_pad_new_from_template(name, target, pads));
  gst_object_unref(target);
}

void init(Element* element) {
  element->decoder = GST_ELEMENT(g_object_new(decoderType(), "name", "decoder", nullptr));
  element->renderer = GST_ELEMENT(g_object_new(rendererType(), "name", "renderer", nullptr));
  gst_bin_add_many(GST_BIN(element), element->decoder, element->renderer, nullptr);
  gst_element_link(element->decoder, element->renderer);
  addGhost(element, element->decoder, "sink");
  addGhost(element, element->renderer, "src");
}

}  // namespace

bool registerVideoDecoder(GstPlugin* plugin) {
  static const GType type =
      elementType<Element, ElementClass>(GST_TYPE_BIN, "GstIsoreelVideoDec", initClass, init);
  return gst_element_register(plugin, "isoreelvideodec", GST_RANK_PRIMARY, type);
}

}  // namespace isoreel::gst
