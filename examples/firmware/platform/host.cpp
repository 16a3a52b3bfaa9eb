// The replay on the machine that builds: `replay recording.bin`.
#include <cstdio>
#include <fstream>
#include <vector>

#include "platform/platform.hpp"
#include "replay/methods.hpp"

namespace platform {

void print(const char* text) { std::fputs(text, stdout); }
std::uint32_t now() { return 0; }
std::uint32_t instructions(std::uint32_t, std::uint32_t) { return 0; }
void paint_stack() {}
std::uint32_t stack_used() { return 0; }

}  // namespace platform

namespace {

// Empty when the file cannot be read. Of 64-bit words, for their alignment.
std::vector<std::uint64_t> read_file(const char* path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return {};
  std::vector<std::uint64_t> words((std::size_t(file.tellg()) + 7) / 8);
  file.seekg(0);
  file.read(reinterpret_cast<char*>(words.data()), std::streamsize(words.size() * 8));
  return words;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: replay RECORDING\n");
    return 2;
  }
  const std::vector<std::uint64_t> words = read_file(argv[1]);
  replay::Recording recording;
  if (!replay::read(words.data(), words.size() * 8, recording)) {
    std::fprintf(stderr, "%s: not a recording of make_recording.py\n", argv[1]);
    return 2;
  }
  replay::paper(recording);
  replay::full(recording);
}
