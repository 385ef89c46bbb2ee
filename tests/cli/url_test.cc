// SPDX-License-Identifier: BSD-3-Clause
// Files behind URLs, from stock servers: Apache sends several ranges at once, busybox one, Python's server
// none. The first two log each request.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
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
  EXPECT_EQ(bind(there, reinterpret_cast<sockaddr*>(&address), size), 0);
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
  /// long.isr: a thousand keys, with 2 MB of something else behind them.
  void makeLong() const {
    longSequence(40);
    ok("isoreel encode long.json -o part.isr --iso 0 --frame-types intra");
    std::string parts;
    for (int i = 0; i < 25; ++i) parts += " part.isr";
    ok("isoreel concat" + parts + " -o long.isr");
    ok("head -c 2000000 /dev/urandom > noise && isoreel attach long.isr noise");
  }
  std::string serve(const std::string& line, int port) {
    server_ = start(line);
    for (int i = 0; i < 200 && !listens(port); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return fmt::format("http://127.0.0.1:{}/", port);
  }
  std::string serveByApache() {
    const int port = freePort();
    std::string conf =
        "ServerName localhost\nUser nobody\nGroup nogroup\nEnableSendfile off\nCustomLog log url:%U\n"
        "LoadModule mpm_event_module /usr/lib/apache2/modules/mod_mpm_event.so\n"
        "LoadModule authz_core_module /usr/lib/apache2/modules/mod_authz_core.so\n";
    conf += fmt::format("Listen 127.0.0.1:{}\nServerRoot {}\nDocumentRoot {}\nPidFile pid\nErrorLog errors\n",
                        port, path(""), path(""));
    write("conf", conf);
    std::filesystem::permissions(folder_, std::filesystem::perms(0755));  // nobody's, when root runs this
    return serve("/usr/sbin/apache2 -DFOREGROUND -f " + path("conf"), port);
  }
  ~UrlTest() override {
    if (server_ > 0) kill(server_, SIGTERM);
    if (server_ > 0) wait(server_);
  }
  /// Requests for the file since this was asked last.
  std::size_t requests() {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // the log is another process's
    const std::string log = content("log");
    std::size_t count = 0;
    for (std::size_t at = 0; (at = log.find("url:/long", at)) != std::string::npos; ++at) ++count;
    return count - std::exchange(before_, count);
  }

 private:
  pid_t server_ = 0;
  std::size_t before_ = 0;
};

TEST_F(UrlTest, AnyFrameCostsTwoRequests) {
  makeLong();
  const std::string url = serveByApache();
  ok("isoreel decode long.isr --frames 700 -o file.ply");
  ok("isoreel decode " + url + "long.isr --frames 0 --discard");
  EXPECT_LE(requests(), 2u);
  ok("isoreel decode " + url + "long.isr --frames 700 -o net.ply");
  EXPECT_EQ(requests(), 2u);
  EXPECT_EQ(content("net.ply"), content("file.ply"));
  ok("isoreel decode " + url + "long.isr --frames 700:710 --discard");
  EXPECT_EQ(requests(), 2u);
  EXPECT_EQ(json("isoreel info " + url + "long.isr --json")["frames"], 1000);
  EXPECT_EQ(requests(), 1u);
}

TEST_F(UrlTest, AServerOfSingleRangesTakesOneMore) {
  makeLong();
  const int port = freePort();
  const std::string url = serve(fmt::format("busybox httpd -f -vv -p 127.0.0.1:{} -h . 2> log", port), port);
  ok("isoreel decode long.isr --frames 700 -o file.ply");
  ok("isoreel decode " + url + "long.isr --frames 0 --discard");
  EXPECT_EQ(requests(), 2u);
  ok("isoreel decode " + url + "long.isr --frames 700 -o net.ply");
  EXPECT_LE(requests(), 3u);
  EXPECT_EQ(content("net.ply"), content("file.ply"));
  ok("isoreel remux long.isr -o long.mkv 2>/dev/null && isoreel decode " + url +
     "long.mkv --frames 700 -o net.ply --force");
  EXPECT_EQ(content("net.ply"), content("file.ply"));
  fails("isoreel info " + url + "none.isr", 1, "404");
}

TEST_F(UrlTest, AServerWithoutRangesPlaysForward) {
  sequence();
  ok("isoreel encode seq.json -o long.isr --iso 0");
  const int port = freePort();
  const std::string url =
      serve(fmt::format("python3 -m http.server {} --bind 127.0.0.1 > log 2>&1", port), port);
  ok("isoreel decode long.isr --frames 5 -o file.ply && isoreel decode " + url +
     "long.isr --frames 5 -o net.ply");
  EXPECT_EQ(content("net.ply"), content("file.ply"));
  EXPECT_EQ(json("isoreel info " + url + "long.isr --json")["frames"], 8);
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
