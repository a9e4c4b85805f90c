// Reading .vdb files. The reader of OpenVDB 10.0.1 crashes on some damaged files (it writes past its buffers
// where Blosc data lie about their size): positions and sizes are checked here and a short file shows as an
// error, but damage inside the packed data cannot be seen beforehand. Untrusted files are for a reader
// (vsh_run.reader), which runs what stands here in a process of its own.
#include "levelset/grid_reader.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <sys/stat.h>

namespace vshi {

namespace {

using openvdb::GridBase;
using openvdb::MetaMap;
using openvdb::io::GridDescriptor;

constexpr size_t HEADER = UUID_AT + UUID_LENGTH;
constexpr unsigned char MAGIC[8] = {0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0};

// The file's size, once it is known to be a .vdb file that OpenVDB has a chance to read.
uint64_t check_file(const char *path, vsh_error *error) {
    const auto fail = [&](const char *reason) {
        return Failure{vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path, reason)};
    };
    struct stat status;
    if (::stat(path, &status) != 0) {
        throw fail(std::strerror(errno));
    }
    if (!S_ISREG(status.st_mode)) {
        throw fail(S_ISDIR(status.st_mode) ? "it is a folder" : "it is no regular file");
    }
    const std::unique_ptr<FILE, int (*)(FILE *)> file(std::fopen(path, "rbe"), std::fclose);
    if (file == nullptr) {
        throw fail(std::strerror(errno));
    }
    unsigned char header[HEADER];
    const size_t size = std::fread(header, 1, sizeof header, file.get());
    if (size == 0 && std::ferror(file.get())) {
        throw fail(std::strerror(errno));
    }
    if (std::memcmp(header, MAGIC, std::min(size, sizeof MAGIC)) != 0 || size == 0) {
        throw fail("it is no OpenVDB file");
    }
    if (size < sizeof header) {
        throw fail("it is cut short within its header");
    }
    const uint32_t version =
        header[8] | uint32_t(header[9]) << 8 | uint32_t(header[10]) << 16 | uint32_t(header[11]) << 24;
    if (version > openvdb::OPENVDB_FILE_VERSION) {
        throw Failure{vshi_fail(error, VSH_ERROR_READ,
                                "%s: cannot be read: format version %u, this OpenVDB reads up to %u", path,
                                version, uint32_t(openvdb::OPENVDB_FILE_VERSION))};
    }
    return uint64_t(status.st_size);
}

std::string shown_name(const GridDescriptor &entry) {
    return GridDescriptor::nameAsString(entry.uniqueName());
}

} // namespace

GridReader::GridReader(const char *path, const vsh_run &run, vsh_error *error)
    : size(check_file(path, error)) {
    if (file.open(path, std::ios::in | std::ios::binary) == nullptr) {
        throw Failure{vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path, std::strerror(errno))};
    }
    stream.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    openvdb::io::setStreamMetadataPtr(stream, state, false);
    readHeader(stream);
    setFormatVersion(stream); // what is read from it from here on depends on these
    setLibraryVersion(stream);
    setDataCompression(stream);
    streamed = !inputHasGridOffsets();
    if (streamed) { // all of it has to be read: at least as much as the file is long
        require(check_bytes(&run, double(size), path, error));
        stream.seekg(0);
        openvdb::io::Stream all(stream, false);
        for (const GridBase::Ptr &one : *all.getGrids()) {
            entries.emplace_back(one->getName(), one->type());
            grids.push_back(one);
        }
    } else {
        MetaMap().readMeta(stream);
        list(stream, path, error);
    }
}

void GridReader::list(std::istream &in, const char *path, vsh_error *error) {
    const int32_t number = readGridCount(in);
    for (int32_t i = 0; i < number; ++i) {
        GridDescriptor entry;
        grids.push_back(entry.read(in));
        const int64_t begin = entry.getGridPos(), blocks = entry.getBlockPos(), end = entry.getEndPos();
        if (begin < int64_t(HEADER) || end <= in.tellg() ||
            (!entry.isInstance() && (blocks < begin || end < blocks))) {
            throw Failure{vshi_fail(error, VSH_ERROR_READ, "%s: damaged: grid '%s' at bytes %lld … %lld",
                                    path, shown_name(entry).c_str(), static_cast<long long>(begin),
                                    static_cast<long long>(end))};
        }
        if (uint64_t(end) > size) {
            throw Failure{vshi_fail(error, VSH_ERROR_READ,
                                    "%s: cut short: grid '%s' ends at byte %lld, the file at %llu", path,
                                    shown_name(entry).c_str(), static_cast<long long>(end),
                                    static_cast<unsigned long long>(size))};
        }
        entries.push_back(entry);
        entry.seekToEnd(in);
    }
}

MetaMap GridReader::metadata(size_t i) {
    if (streamed) {
        return *grids[i];
    }
    entries[i].seekToGrid(stream);
    readGridCompression(stream);
    MetaMap metadata;
    metadata.readMeta(stream);
    return metadata;
}

double GridReader::bytes(size_t i) {
    const MetaMap known = metadata(i);
    const auto bytes = known.getMetadata<openvdb::Int64Metadata>(GridBase::META_FILE_MEM_BYTES);
    return bytes ? double(bytes->value()) : double(size);
}

GridBase::Ptr GridReader::without_tree(size_t i) {
    const GridBase::Ptr result = grids[i]->copyGrid();
    if (!streamed) {
        entries[i].seekToGrid(stream);
        readGridCompression(stream);
        result->readMeta(stream);
        if (openvdb::io::getFormatVersion(stream) >= openvdb::OPENVDB_FILE_VERSION_GRID_INSTANCING) {
            result->readTransform(stream); // behind the tree in older files
        }
    }
    return result;
}

GridBase::Ptr GridReader::sound(const GridBase::Ptr &read, size_t i, const char *path, vsh_error *error) {
    if (!file.sound()) {
        throw Failure{vshi_fail(error, VSH_ERROR_READ,
                                "%s: damaged: grid '%s': Zip data that do not fit their check sum", path,
                                name(i).c_str())};
    }
    return read;
}

GridBase::Ptr GridReader::grid(size_t i, const char *path, vsh_error *error) {
    return sound(streamed ? grids[i] : read_tree(i), i, path, error);
}

GridBase::Ptr GridReader::read_tree(size_t i) {
    const GridDescriptor &entry = entries[i];
    const GridBase::Ptr result = grids[i]->copyGrid();
    entry.seekToGrid(stream);
    readGrid(result, entry, stream);
    if (entry.isInstance()) { // of another grid's tree
        NamedGridMap named{{entry.uniqueName(), result}};
        for (size_t j = 0; j < entries.size(); ++j) {
            if (j != i && !entries[j].isInstance() && entries[j].uniqueName() == entry.instanceParentName()) {
                const GridBase::Ptr parent = grids[j]->copyGrid();
                entries[j].seekToGrid(stream);
                readGrid(parent, entries[j], stream);
                named[entries[j].uniqueName()] = parent;
            }
        }
        connectInstance(entry, named);
    }
    return result;
}

} // namespace vshi
