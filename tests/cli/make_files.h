// SPDX-License-Identifier: BSD-3-Clause
// What both halves of the `.isr` vectors' maker use: frames, and files with what is found in them.
#pragma once

#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "file_maker.h"
#include "observed.h"

namespace isoreel {

/// Writes files with what is found in them, and complains where that is not what was meant.
class Files {
 public:
  explicit Files(std::string folder) : folder_(std::move(folder)) {}

  void accept(const std::string& name, const char* spec, const std::string& shows, const Bytes& bytes) {
    const nlohmann::ordered_json found = add("files", name, spec, shows, bytes);
    if (found.dump().find("\"error\"") != std::string::npos ||
        found.dump().find("\"damage\":[]") == std::string::npos)
      fail(name, found.dump(1));
  }
  /// A file that is unfinished or breaks a rule: `error` is part of what is said about it.
  void damaged(const std::string& name, const char* spec, const std::string& error, const Bytes& bytes) {
    const nlohmann::ordered_json found = add("files", name, spec, "broken: " + error, bytes);
    if (found.dump().find(error) == std::string::npos) fail(name, found.dump(1));
  }
  void reject(const std::string& name, const char* spec, const std::string& error, const Bytes& bytes) {
    const std::string file = write(name, bytes);
    const auto found = cli::observeFile(folder_ + "/" + file);
    if (found.ok() || found.error().message.find(error) == std::string::npos)
      fail(name, found.ok() ? "is not refused" : found.error().message);
    lists_["reject_files"].push_back({{"name", name}, {"file", file}, {"spec", spec}, {"error", error}});
  }
  /// Leaves the manifest's lists of packets as they are.
  bool finish() {
    std::ifstream in(folder_ + "/manifest.json");
    nlohmann::ordered_json manifest = nlohmann::ordered_json::parse(in);
    manifest.update(lists_);
    std::ofstream(folder_ + "/manifest.json") << manifest.dump(1) << "\n";
    return !failed_;
  }

 private:
  nlohmann::ordered_json add(const char* list, const std::string& name, const char* spec,
                             const std::string& shows, const Bytes& bytes) {
    const std::string file = write(name, bytes);
    const auto found = cli::observeFile(folder_ + "/" + file);
    if (!found.ok()) {
      fail(name, found.error().message);
      return {};
    }
    nlohmann::ordered_json entry = {{"name", name}, {"file", file}, {"spec", spec}, {"shows", shows}};
    entry.update(*found);
    lists_[list].push_back(entry);
    return *found;
  }
  std::string write(const std::string& name, const Bytes& bytes) {
    if (bytes.size() > 2500) fail(name, "has " + std::to_string(bytes.size()) + " bytes");
    const std::string file = name + ".isr";
    std::ofstream(folder_ + "/" + file, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return file;
  }
  void fail(const std::string& name, const std::string& why) {
    std::cerr << name << ": " << why << "\n";
    failed_ = true;
  }

  std::string folder_;
  nlohmann::ordered_json lists_ = {{"files", nlohmann::ordered_json::array()},
                                   {"reject_files", nlohmann::ordered_json::array()}};
  bool failed_ = false;
};

/// A ball that moves, as an I frame and P frames.
std::vector<Packet> spheres(int count);
/// A small ball's packet as frame `number` of a file of I frames.
Packet still(std::uint64_t number);
/// Files of `still` frames, and of an I frame and three P frames.
Bytes plain(int frames = 2);
Bytes predicted(bool finished = true);

void makeBrokenFiles(Files& files);

}  // namespace isoreel
