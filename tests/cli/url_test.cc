// SPDX-License-Identifier: BSD-3-Clause
// Files behind URLs, from stock servers: busybox knows ranges and logs each request, Python's server does
// not.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "support.h"

namespace isoreel::cli {
namespace {

sockaddr_in local(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

int freePort() {
  sockaddr_in address = local(0);
  socklen_t size = sizeof address;
  const int there = socket(AF_INET, SOCK_STREAM, 0);
  bind(there, reinterpret_cast<sockaddr*>(&address), size);
  getsockname(there, reinterpret_cast<sockaddr*>(&address), &size);
  close(there);
  return ntohs(address.sin_port);
}

bool listens(int port) {
  const sockaddr_in address = local(port);
  const int there = socket(AF_INET, SOCK_STREAM, 0);
  const bool heard = connect(there, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(there);
  return heard;
}

class UrlTest : public CliTest {
 protected:
  /// A thousand keys in 1 MB or so, and its server. `line` takes a port.
  std::string serve(const std::string& line) {
    longSequence(1000);
    ok("isoreel encode long.json -o long.isr --iso 0 --frame-types intra");
    const int port = freePort();
    server_ = start(fmt::format(fmt::runtime(line), fmt::arg("port", port)));
    for (int i = 0; i < 200 && !listens(port); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return fmt::format("http://127.0.0.1:{}/", port);
  }
  ~UrlTest() override {
    if (server_ > 0) kill(server_, SIGTERM);
    if (server_ > 0) wait(server_);
  }
  /// Requests for the file so far.
  std::size_t requests() const {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));  // the log is another process's
    const std::string log = content("log");
    std::size_t count = 0;
    for (std::size_t at = 0; (at = log.find("url:/long", at)) != std::string::npos; ++at) ++count;
    return count;
  }

 private:
  pid_t server_ = 0;
};

TEST_F(UrlTest, FramesCostFewRequests) {
  const std::string url = serve("busybox httpd -f -vv -p 127.0.0.1:{port} -h . 2> log");
  EXPECT_GT(bytes("long.isr"), std::uintmax_t{400000});
  ok("isoreel decode long.isr --frames 700 -o file.ply");
  std::size_t before = requests();
  const auto used = [&] { return requests() - std::exchange(before, requests()); };
  ok("isoreel decode " + url + "long.isr --frames 0 --discard");
  EXPECT_LE(used(), 2u);
  // Opening, and one for a frame elsewhere.
  ok("isoreel decode " + url + "long.isr --frames 700 -o net.ply");
  EXPECT_LE(used(), 3u);
  EXPECT_EQ(content("net.ply"), content("file.ply"));
  ok("isoreel decode " + url + "long.isr --frames 700:710 --discard");
  EXPECT_LE(used(), 3u);
  EXPECT_EQ(json("isoreel info " + url + "long.isr --json")["frames"], 1000);
  EXPECT_LE(used(), 2u);
  ok("isoreel remux long.isr -o long.mkv && isoreel decode " + url +
     "long.mkv --frames 700 -o net.ply --force");
  EXPECT_EQ(content("net.ply"), content("file.ply"));
  fails("isoreel info " + url + "none.isr", 1, "404");
}

TEST_F(UrlTest, AServerWithoutRangesPlaysForward) {
  const std::string url = serve("python3 -m http.server {port} --bind 127.0.0.1 > log 2>&1");
  ok("isoreel decode long.isr --frames 7 -o file.ply && isoreel decode " + url +
     "long.isr --frames 7 -o net.ply");
  EXPECT_EQ(content("net.ply"), content("file.ply"));
  EXPECT_EQ(json("isoreel info " + url + "long.isr --json")["frames"], 1000);
}

TEST_F(UrlTest, OtherProtocolsAndNamesWithColons) {
  sequence();
  ok("isoreel encode seq.json -o a.isr --iso 0 && cp a.isr file:a.isr && cp a.isr http:b.isr");
  ok("isoreel verify file:" + path("a.isr"));
  ok("isoreel verify file:a.isr && isoreel verify http:b.isr");  // files of these names are there
  ok("isoreel verify pipe:0 < a.isr && cat a.isr | isoreel verify pipe:0");
  fails("isoreel info http://127.0.0.1:1/a.isr", 1, "http://127.0.0.1:1/a.isr: cannot open");
  fails("isoreel info nothing:a.isr", 1, "nothing:a.isr");
}

}  // namespace
}  // namespace isoreel::cli
