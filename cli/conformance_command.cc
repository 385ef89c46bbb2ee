// SPDX-License-Identifier: BSD-3-Clause
// Runs the vectors of a folder by its manifest, whose form spec/README.md tells.
#include <fmt/format.h>
#include <isoreel/codec/decoder.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "command.h"
#include "observed.h"
#include "output.h"

namespace isoreel::cli {
namespace {

using Json = nlohmann::ordered_json;

struct ConformanceOptions {
  std::string folder;
  bool json = false;
};

/// Whether what was found is what was expected: the same, but that of an "error" and of lines of "damage" the
/// expected text is a part.
bool agrees(const Json& expected, const Json& found, bool message = false) {
  if (expected.is_array()) {
    return found.is_array() &&
           std::equal(expected.begin(), expected.end(), found.begin(), found.end(),
                      [&](const Json& a, const Json& b) { return agrees(a, b, message); });
  }
  if (expected.is_object()) {
    if (!found.is_object() || found.size() != expected.size()) return false;
    // NOLINTNEXTLINE(readability-use-anyofallof): names of the two cannot be those of a lambda's parameters
    for (const auto& [key, value] : expected.items()) {
      if (!found.contains(key) || !agrees(value, found[key], key == "error" || key == "damage")) return false;
    }
    return true;
  }
  if (!message || !expected.is_string() || !found.is_string()) return expected == found;
  return found.get<std::string>().find(expected.get<std::string>()) != std::string::npos;
}

class Conformance {
 public:
  explicit Conformance(std::string folder) : folder_(std::move(folder)) {}

  Status run() {
    ISOREEL_ASSIGN(const Bytes text, bytesOf("manifest.json"));
    const Json manifest = Json::parse(text);
    for (const auto& [kind, entries] : manifest.items()) {
      for (const Json& entry : entries) {
        name_ = entry.at("name").get<std::string>();
        const std::size_t before = differences.size();
        if (kind == "accept")
          ISOREEL_TRY(accept(entry));
        else if (kind == "reject")
          ISOREEL_TRY(reject(entry, {}));
        else if (kind == "sequences")
          ISOREEL_TRY(sequence(entry));
        else if (kind == "reject_after")
          ISOREEL_TRY(reject(entry, entry.at("after")));
        else if (kind == "files")
          file(entry);
        else if (kind == "reject_files")
          rejectFile(entry);
        else
          return {ErrorCode::kUnsupported, fmt::format("manifest.json: what are '{}'?", kind)};
        ++vectors;
        if (differences.size() > before) ++different;
      }
    }
    if (vectors > 0) return {};
    return {ErrorCode::kBadData, "manifest.json: it lists no vectors"};
  }

  std::size_t vectors = 0, different = 0;
  Json differences = Json::array();

 private:
  Result<Bytes> bytesOf(const std::string& file) const {
    std::ifstream in(folder_ + "/" + file, std::ios::binary);
    Bytes bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    if (in.bad() || !in.is_open()) return {ErrorCode::kIo, fmt::format("{}: cannot be read", file)};
    return bytes;
  }

  void expect(const std::string& what, const Json& expected, const Json& found) {
    if (!agrees(expected, found))
      differences.push_back({{"vector", name_}, {"what", what}, {"expected", expected}, {"found", found}});
  }
  void expectSurface(const std::string& what, const Json& expected, const Result<Surface>& found) {
    const Json wanted = {{"vertices", expected.at("vertices")},
                         {"faces", expected.at("faces")},
                         {"hash", expected.at("hash")}};
    expect(what, wanted, found.ok() ? summaryOf(*found) : Json{{"error", found.error().message}});
  }
  void expectRefused(const std::string& what, const Json& error, const Status& found) {
    expect(what, {{"error", error}}, found.ok() ? Json("was not refused") : Json{{"error", found.message()}});
  }

  /// Levels, and prefixes that give one of them, of a packet that `before` can decode next.
  void expectParts(const Json& entry, ByteSpan packet, const Decoder& before) {
    const Json& levels = entry.at("levels");
    for (std::uint32_t level = 0; level < levels.size(); ++level) {
      DecodeOptions options;
      options.level = level;
      Decoder decoder(before);
      expectSurface(fmt::format("level {}", level), levels[level], decoder.decode(packet, options));
    }
    for (const Json& prefix : entry.at("prefixes"))
      expectPrefix(prefix, levels.at(prefix.at("level").get<std::size_t>()), packet, before);
  }
  void expectPrefix(const Json& prefix, const Json& expected, ByteSpan packet, const Decoder& before) {
    const std::size_t bytes = prefix.at("bytes").get<std::size_t>();
    const ByteSpan cut = packet.first(std::min(bytes, packet.size()));
    DecodeOptions options;
    options.allow_prefix = true;
    Decoder decoder(before), whole(before);
    expectSurface(fmt::format("its first {} bytes", bytes), expected, decoder.decode(cut, options));
    expectRefused(fmt::format("its first {} bytes, taken for the whole", bytes), "",
                  whole.decode(cut).status());
  }

  Status accept(const Json& entry) {
    ISOREEL_ASSIGN(const Bytes packet, bytesOf(entry.at("file").get<std::string>()));
    expectSurface("surface", entry, Decoder().decode(packet));
    expectParts(entry, packet, Decoder());
    return {};
  }
  Status sequence(const Json& entry) {
    Decoder decoder, before;
    Bytes packet;
    for (const Json& each : entry.at("packets")) {
      const std::string file = each.at("file").get<std::string>();
      ISOREEL_ASSIGN(packet, bytesOf(file));
      before = decoder;
      expectSurface(file, each, decoder.decode(packet));
    }
    expectParts(entry, packet, before);
    expectPrefix(entry.at("prefix"), entry.at("prefix"), packet, before);
    return {};
  }
  Status reject(const Json& entry, const Json& after) {
    Decoder decoder;
    for (const Json& file : after) {
      ISOREEL_ASSIGN(const Bytes packet, bytesOf(file.get<std::string>()));
      static_cast<void>(decoder.decode(packet));
    }
    ISOREEL_ASSIGN(const Bytes packet, bytesOf(entry.at("file").get<std::string>()));
    expectRefused("packet", entry.at("error"), decoder.decode(packet).status());
    return {};
  }

  void file(const Json& entry) {
    const Result<Json> found = observeFile(folder_ + "/" + entry.at("file").get<std::string>());
    if (!found.ok()) return expect("file", "a file that opens", {{"error", found.error().message}});
    for (const auto& [what, value] : found->items()) expect(what, {{what, entry.at(what)}}, {{what, value}});
  }
  void rejectFile(const Json& entry) {
    expectRefused("file", entry.at("error"),
                  observeFile(folder_ + "/" + entry.at("file").get<std::string>()).status());
  }

  const std::string folder_;
  std::string name_;  // of the vector at hand
};

Status conformance(const ConformanceOptions& options) {
  Conformance vectors(options.folder);
  try {
    ISOREEL_TRY(vectors.run().at(options.folder));
  } catch (const Json::exception& error) {
    return {ErrorCode::kBadData, fmt::format("{}: manifest.json: {}", options.folder, error.what())};
  }
  const auto text = [](const Json& value) {
    return value.dump(-1, ' ', false, Json::error_handler_t::replace);
  };
  if (options.json) {
    fmt::print("{}\n", text({{"ok", vectors.different == 0},
                             {"vectors", vectors.vectors},
                             {"different", vectors.different},
                             {"differences", vectors.differences}}));
  } else {
    for (const Json& each : vectors.differences)
      fmt::print("{}: {}: {} where {} is due\n", each["vector"].get<std::string>(),
                 each["what"].get<std::string>(), text(each["found"]), text(each["expected"]));
    if (vectors.different == 0)
      fmt::print("{}: {}, all decode as they should\n", options.folder, counted(vectors.vectors, "vector"));
  }
  if (vectors.different == 0) return {};
  return {ErrorCode::kBadData, fmt::format("{}: {} of {} differ", options.folder, vectors.different,
                                           counted(vectors.vectors, "vector"))};
}

}  // namespace

void addConformanceCommand(CLI::App& app, Action& chosen) {
  CLI::App* verb = app.add_subcommand(
      "conformance",
      "Decode the format's vectors and compare with what they must give; exit 1 if any differs");
  const auto options = std::make_shared<ConformanceOptions>();
  verb->add_option("folder", options->folder, "The folder with manifest.json, as spec/vectors of the sources")
      ->required();
  verb->add_flag("--json", options->json,
                 "One JSON object: ok, vectors, different, differences (vector, what, expected, found)");
  verb->callback([options, &chosen] { chosen = [options] { return conformance(*options); }; });
}

}  // namespace isoreel::cli
