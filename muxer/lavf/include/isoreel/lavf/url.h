// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <isoreel/container/byte_source.h>

#include <functional>
#include <memory>
#include <string>

namespace isoreel::lavf {

/// Whether `name` is to be opened by openUrl(): it starts with a protocol of libavformat's and a colon
/// ("https://…", "file:…", "pipe:0"), and there is no file of this name.
bool isUrl(const std::string& name);

/// The bytes behind a URL, by libavformat's protocols. Seekable where the protocol and the server are
/// (HTTP: ranges); else front to back, as a pipe. Over HTTP, opening is one request, for the first 64 KiB and
/// the last 512 KiB, where an index stands; these stay in memory. From a server that cannot send two ranges
/// at once the last ones are one request more. A file of at most 576 KiB is read whole. Reading on where the
/// last read ended, or up to 1 MiB behind that, is no request, and neither is going back by up to 8 MiB of
/// what was read; reading elsewhere is one. A connection that breaks off is made anew where it broke.
/// `stopped` is asked while the network is waited for: when true, reading fails (kIo). So does a server that
/// is silent for 30 seconds. kNotFound when it is not there, kIo when it cannot be had.
Result<std::unique_ptr<ByteSource>> openUrl(const std::string& url, std::function<bool()> stopped = {});

}  // namespace isoreel::lavf
