// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/container/byte_sink.h>

#include <string>
#include <utility>

namespace isoreel::gst {

/// Where the writer's bytes wait to be sent on.
class Outbox final : public ByteSink {
 public:
  Outbox(Bytes& bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}
  Status append(ByteSpan more) override {
    bytes_.insert(bytes_.end(), more.begin(), more.end());
    return {};
  }
  Status commit() override { return {}; }
  void discard() override {}
  std::string name() const override { return name_; }

 private:
  Bytes& bytes_;
  std::string name_;
};

}  // namespace isoreel::gst
