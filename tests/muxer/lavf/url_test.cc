// SPDX-License-Identifier: BSD-3-Clause
// Bytes from servers of every temper, each of which counts its requests; tests/cli has stock ones.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <isoreel/lavf/url.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "byte_ranges.h"

namespace isoreel::lavf {
namespace {

enum class Temper { kBothEnds, kCutsParts, kFirstRangeOnly, kRefusesTwo, kWholeOnly, kHangsUp };

std::string part(const std::string& content, std::size_t first, std::size_t end) {
  return "Content-Range: bytes " + std::to_string(first) + "-" + std::to_string(end - 1) + "/" +
         std::to_string(content.size()) + "\r\n";
}

std::string answer(const std::string& status, const std::string& fields, const std::string& body) {
  return "HTTP/1.1 " + status + "\r\nContent-Length: " + std::to_string(body.size()) +
         "\r\nConnection: close\r\n" + fields + "\r\n" + body;
}

class Server {
 public:
  Server(std::string content, Temper temper) : content_(std::move(content)), temper_(temper) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* any = reinterpret_cast<sockaddr*>(&address);
    socket_ = socket(AF_INET, SOCK_STREAM, 0);
    EXPECT_EQ(bind(socket_, any, size), 0);
    EXPECT_EQ(listen(socket_, 16), 0);
    getsockname(socket_, any, &size);
    url_ = "http://127.0.0.1:" + std::to_string(ntohs(address.sin_port)) + "/x";
    accepting_ = std::thread([this] {
      for (int client = -1; (client = accept(socket_, nullptr, nullptr)) >= 0;)
        serving_.emplace_back([this, client] { serve(client); });
    });
  }
  ~Server() {
    shutdown(socket_, SHUT_RDWR);
    accepting_.join();
    for (std::thread& thread : serving_) thread.join();
    close(socket_);
  }
  const std::string& url() const { return url_; }
  int requests() const { return requests_; }

 private:
  void serve(int client) {
    std::string request(4096, '\0');
    request.resize(static_cast<std::size_t>(std::max<ssize_t>(recv(client, request.data(), 4096, 0), 0)));
    ++requests_;
    const std::string text = answerTo(request);
    for (std::size_t sent = 0; sent < text.size();) {
      const ssize_t count = send(client, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) break;
      sent += static_cast<std::size_t>(count);
    }
    close(client);
  }
  std::string answerTo(const std::string& request) const {
    const std::size_t at = request.find("Range: bytes=");
    const std::string range =
        at == std::string::npos ? "" : request.substr(at + 13, request.find('\r', at) - at - 13);
    const std::size_t comma = range.find(',');
    if (temper_ == Temper::kWholeOnly) return answer("200 OK", "", content_);
    std::size_t first = std::stoul("0" + range), end = content_.size();
    if (comma == std::string::npos) {
      std::string text = answer("206 Partial Content", part(content_, first, end), content_.substr(first));
      if (temper_ == Temper::kHangsUp) text.resize(std::min<std::size_t>(text.size(), 400000));
      return text;
    }
    if (temper_ == Temper::kRefusesTwo) return answer("400 Bad Request", "", "");
    end = std::stoul(range.substr(range.find('-') + 1)) + 1;
    if (temper_ == Temper::kFirstRangeOnly)
      return answer("206 Partial Content", part(content_, first, end), content_.substr(first, end));
    const std::size_t tail = content_.size() - std::stoul(range.substr(comma + 2));
    std::string body = "\r\n--xyz\r\n" + part(content_, 0, end) + "\r\n" + content_.substr(0, end) +
                       "\r\n--xyz\r\n" + part(content_, tail, content_.size()) + "\r\n" +
                       content_.substr(tail) + "\r\n--xyz--\r\n";
    if (temper_ == Temper::kCutsParts) body.resize(body.size() / 2);
    return answer("206 Partial Content", "Content-Type: multipart/byteranges; boundary=xyz\r\n", body);
  }

  const std::string content_;
  const Temper temper_;
  std::string url_;
  int socket_ = -1;
  std::atomic<int> requests_{0};
  std::thread accepting_;
  std::vector<std::thread> serving_;
};

std::string someBytes(std::size_t count) {
  std::string bytes(count, '\0');
  std::uint32_t state = 1;
  for (char& c : bytes) c = static_cast<char>((state = state * 1664525 + 1013904223) >> 24);
  return bytes;
}

/// Bytes of the source, which must be as many.
std::string readAt(ByteSource& source, std::size_t offset, std::size_t count) {
  std::string out(count, '\0');
  const auto got = source.read(offset, std::span(reinterpret_cast<std::uint8_t*>(out.data()), count));
  EXPECT_TRUE(got.ok()) << got.status().message();
  out.resize(got.ok() ? *got : 0);
  return out;
}

constexpr std::size_t kLong = 4000000;

TEST(Url, AnyByteCostsTwoRequestsAndThoseNearByNone) {
  const std::string content = someBytes(kLong);
  const Server server(content, Temper::kBothEnds);
  const auto source = *openUrl(server.url());
  EXPECT_EQ(source->size(), content.size());
  for (const std::size_t offset : {std::size_t{0}, std::size_t{60000}, kLong - 500000, kLong - 10})
    EXPECT_EQ(readAt(*source, offset, 5000), content.substr(offset, 5000));
  EXPECT_EQ(server.requests(), 1);
  for (const std::size_t offset : {2000000u, 2005000u, 2900000u, 2100000u, 0u, 3000000u})
    EXPECT_EQ(readAt(*source, offset, 5000), content.substr(offset, 5000));
  EXPECT_EQ(server.requests(), 2);
  EXPECT_EQ(readAt(*source, 1000000, kLong), content.substr(1000000));
  EXPECT_EQ(readAt(*source, 0, kLong), content);
  EXPECT_EQ(server.requests(), 4);
  EXPECT_EQ(readAt(*source, kLong, 1), "");
}

TEST(Url, ServersOfEveryTemperGiveTheSameBytes) {
  const std::string content = someBytes(kLong);
  for (const auto& [temper, requests] :
       {std::pair(Temper::kCutsParts, 4), std::pair(Temper::kFirstRangeOnly, 3),
        std::pair(Temper::kRefusesTwo, 4)}) {
    SCOPED_TRACE(static_cast<int>(temper));
    const Server server(content, temper);
    const auto source = *openUrl(server.url());
    EXPECT_TRUE(source->seekable());
    EXPECT_EQ(readAt(*source, kLong - 1000, 1000), content.substr(kLong - 1000));
    EXPECT_EQ(readAt(*source, 3000000, 5000), content.substr(3000000, 5000));
    EXPECT_EQ(server.requests(), requests);
    EXPECT_EQ(readAt(*source, 0, kLong), content);
  }
}

TEST(Url, WhereAServerHangsUpReadingGoesOn) {
  const std::string content = someBytes(kLong);
  const Server server(content, Temper::kHangsUp);
  const auto source = *openUrl(server.url());
  EXPECT_EQ(readAt(*source, 1000, kLong), content.substr(1000));
  EXPECT_LE(server.requests(), 12);
}

TEST(Url, WithoutRangesBytesComeForward) {
  const std::string content = someBytes(kLong);
  const Server server(content, Temper::kWholeOnly);
  const auto source = *openUrl(server.url());
  EXPECT_FALSE(source->seekable());
  EXPECT_EQ(readAt(*source, 0, 4096), content.substr(0, 4096));
  EXPECT_EQ(readAt(*source, 2000000, 3000000), content.substr(2000000));
}

TEST(Url, SmallFilesCostOneRequest) {
  for (const Temper temper : {Temper::kFirstRangeOnly, Temper::kBothEnds}) {
    const std::string content = someBytes(600000 - 20000 * (temper == Temper::kFirstRangeOnly));
    const Server server(content, temper);
    EXPECT_EQ(readAt(**openUrl(server.url()), 0, kLong), content);
  }
}

TEST(ByteRanges, CutOrWrongOnesAreNoParts) {
  const std::string type = "Multipart/ByteRanges; boundary=\"a b\"";
  const std::string body =
      "--a b\r\nContent-Type: x\r\ncontent-range: bytes 3-5/100\r\n\r\nabc\r\n--a b\r\nContent-Range: bytes "
      "99-99/100\r\n\r\nz\r\n--a b--\r\n";
  const auto parse = [](const std::string& t, const std::string& b) {
    return parseByteRanges(t, ByteSpan(reinterpret_cast<const std::uint8_t*>(b.data()), b.size()));
  };
  const auto parts = parse(type, body);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].offset, 3u);
  EXPECT_EQ(parts[0].bytes, (Bytes{'a', 'b', 'c'}));
  EXPECT_EQ(parts[1].offset, 99u);
  EXPECT_EQ(parts[1].file_bytes, 100u);
  for (std::size_t length = 0; length < body.size() - 2; ++length)
    EXPECT_TRUE(parse(type, body.substr(0, length)).empty()) << length;
  for (const char* bad : {"5-3/100", "3-5/5", "3-5000000000/9999999999", "-5/100", "3-5/*", "3", ""}) {
    std::string other = body;
    EXPECT_TRUE(parse(type, other.replace(other.find("3-5/100"), 7, bad)).empty()) << bad;
  }
  for (const char* other : {"", "text/html", "multipart/byteranges", "multipart/byteranges; boundary=",
                            "multipart/byteranges; boundary=\"", "multipart/byteranges; boundary=c"})
    EXPECT_TRUE(parse(other, body).empty()) << other;
}

}  // namespace
}  // namespace isoreel::lavf
