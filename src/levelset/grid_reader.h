// A .vdb file's grids, read one at a time and checked as far as can be.
#pragma once

#include "levelset/file.h"

#include <cstdint>
#include <fstream>
#include <istream>
#include <memory>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/Stream.h>
#include <string>
#include <vector>

namespace vshi {

// --- the stream that .vdb files are read from

// Checks the sums (Adler-32, RFC 1950) of a file's Zip data as they are read. OpenVDB 10.0 ignores wrong sums
// and goes on with wrong values. The file gives a size in 8 bytes, then the data in one piece.
class CheckedFile final : public std::filebuf {
  public:
    bool sound() const { return !damaged; }

  protected:
    std::streamsize xsgetn(char *bytes, std::streamsize size) override;

  private:
    int64_t announced = 0; // size that was read last
    bool damaged = false;
};

// --- reading

// A file's grids in the order in which it holds them. OpenVDB's own class for this loads late (a handle to
// the file would linger) and goes on past the end of a file that is cut short.
class GridReader final : public openvdb::io::Archive {
  public:
    GridReader(const char *path, const vsh_run &run, vsh_error *error);

    size_t count() const { return entries.size(); }
    std::string name(size_t i) const {
        return openvdb::io::GridDescriptor::nameAsString(entries[i].uniqueName());
    }
    bool is_named(size_t i, const char *wanted) const {
        return name(i) == wanted || entries[i].gridName() == wanted;
    }
    openvdb::MetaMap metadata(size_t i);
    double bytes(size_t i);                        // in memory, by what the file says of it
    openvdb::GridBase::Ptr without_tree(size_t i); // metadata and transform
    openvdb::GridBase::Ptr grid(size_t i, const char *path, vsh_error *error);
    bool is_streamed() const { return streamed; }

    const uint64_t size;

  private:
    void list(std::istream &in, const char *path, vsh_error *error);
    openvdb::GridBase::Ptr read_tree(size_t i);
    openvdb::GridBase::Ptr sound(const openvdb::GridBase::Ptr &read, size_t i, const char *path,
                                 vsh_error *error);

    // The stream keeps this pointer's address.
    openvdb::io::StreamMetadata::Ptr state = std::make_shared<openvdb::io::StreamMetadata>();
    CheckedFile file;
    std::istream stream{&file};
    std::vector<openvdb::io::GridDescriptor> entries;
    std::vector<openvdb::GridBase::Ptr> grids; // without a tree yet, but for streamed files
    bool streamed = false;
};

} // namespace vshi
