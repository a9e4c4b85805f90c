// The stream that .vdb files are read from.
#pragma once

#include <cstdint>
#include <fstream>

namespace vshi {

// A file whose Zip data are held against their check sums (Adler-32, RFC 1950) as they pass by: OpenVDB 10.0
// takes no notice where they do not fit, and goes on with wrong values. Data come as their size, 8 bytes, and
// then in one piece.
class CheckedFile final : public std::filebuf {
  public:
    bool sound() const { return !damaged; }

  protected:
    std::streamsize xsgetn(char *bytes, std::streamsize size) override;

  private:
    int64_t announced = 0; // by what was read last
    bool damaged = false;
};

} // namespace vshi
