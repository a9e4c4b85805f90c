// Writing .vdb files: whole, or not at all, and the same bytes for the same grids.
#include "base/file.h"
#include "base/text.h"
#include "levelset/file.h"

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <openvdb/io/Archive.h>
#include <sstream>
#include <vector>

namespace vshi {

namespace {

class Writer final : public openvdb::io::Archive {
  public:
    Writer() {
        setCompression(openvdb::io::COMPRESS_ACTIVE_MASK |
                       (hasBloscCompression()  ? openvdb::io::COMPRESS_BLOSC
                        : hasZLibCompression() ? openvdb::io::COMPRESS_ZIP
                                               : openvdb::io::COMPRESS_NONE));
    }
    void write_to(std::ostream &out, const openvdb::GridCPtrVec &grids) const {
        Archive::write(out, grids, true);
    }
};

// The UUID of a file, from its values by FNV-1a. OpenVDB's own is random, but equal grids must give equal
// bytes.
class ContentHash {
  public:
    void add(uint64_t word) {
        for (uint64_t &h : hash) {
            h = (h ^ word) * 0x100000001b3u;
        }
        hash[1] ^= hash[1] >> 29;
    }
    void add(float value) {
        uint32_t bits;
        std::memcpy(&bits, &value, sizeof bits);
        add(uint64_t(bits));
    }
    void add(const FloatTree &tree) {
        for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
            const float *values = leaf->buffer().data();
            for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
                add(values[i]);
            }
        }
        auto tile = tree.cbeginValueOn();
        tile.setMaxDepth(FloatTree::ValueOnCIter::LEAF_DEPTH - 1);
        for (; tile; ++tile) {
            add(uint64_t(tile.getVoxelCount()));
            add(tile.getValue());
        }
    }
    std::string uuid() const {
        char text[UUID_LENGTH + 1];
        std::snprintf(text, sizeof text, "%08x-%04x-4%03x-8%03x-%012llx", unsigned(hash[0] >> 32),
                      unsigned(hash[0] >> 16) & 0xffffu, unsigned(hash[0]) & 0xfffu,
                      unsigned(hash[1] >> 48) & 0xfffu,
                      static_cast<unsigned long long>(hash[1] & 0xffffffffffffu));
        return text;
    }

  private:
    uint64_t hash[2] = {0xcbf29ce484222325u, 0x84222325cbf29ce4u};
};

// Writes a file anew. OpenVDB's own file writing does not check that the last bytes were written.
void write_file(const char *temporary, const char *path, const std::vector<FloatGrid::Ptr> &grids,
                const std::string &uuid) {
    std::vector<char> bytes(size_t(1) << 20);
    std::ofstream stream;
    stream.exceptions(std::ios::failbit | std::ios::badbit);
    stream.rdbuf()->pubsetbuf(bytes.data(), std::streamsize(bytes.size()));
    try {
        errno = 0;
        stream.open(temporary, std::ios::binary);
        Writer().write_to(stream, openvdb::GridCPtrVec(grids.begin(), grids.end()));
        stream.seekp(std::streamoff(UUID_AT));
        stream << uuid;
        stream.close();
    } catch (const std::ios_base::failure &) {
        refuse(VSH_ERROR_WRITE, "%s: could not be written: %s", path,
               errno != 0 ? std::strerror(errno) : "OpenVDB gave no reason");
    }
}

struct Output {
    vshi_output file{nullptr, nullptr, 0};
    ~Output() { vshi_output_abandon(&file); } // nothing, once committed
};

} // namespace

vsh_result write_grids(const char *path, double voxel_size, const vsh_attribute *attributes, size_t count,
                       const std::function<std::vector<FloatGrid::Ptr>()> &make, vsh_error *error) {
    return guard(error, VSH_ERROR_WRITE, path, [&] {
        initialize();
        require(vshi_attributes_check, path, attributes, count);
        if (!(voxel_size >= SMALLEST_WRITTEN)) {
            refuse(VSH_ERROR_LIMIT, "%s: voxel size %g: OpenVDB writes %g and more; scale the scene", path,
                   voxel_size, SMALLEST_WRITTEN);
        }
        const std::vector<FloatGrid::Ptr> grids = make();
        Output output;
        require(vshi_output_begin, &output.file, path);
        ContentHash hash;
        for (const FloatGrid::Ptr &grid : grids) {
            for (size_t i = 0; i < count; ++i) {
                grid->insertMeta(attributes[i].name, openvdb::StringMetadata(attributes[i].value));
            }
            hash.add(grid->tree());
        }
        write_file(output.file.temporary, path, grids, hash.uuid());
        require(vshi_output_commit, &output.file);
    });
}

namespace {

// Reads a map as OpenVDB writes it: its constructors compute scales from differences of positions, which
// loses bits far from the origin.
openvdb::math::Transform::Ptr make_transform(const double *m) {
    namespace math = openvdb::math;
    std::stringstream text;
    openvdb::io::setCurrentVersion(text);
    if (m[1] == 0.0 && m[2] == 0.0 && m[4] == 0.0 && m[6] == 0.0 && m[8] == 0.0 && m[9] == 0.0) {
        const Vec3d scale(m[0], m[5], m[10]), inverse = 1.0 / scale;
        const Vec3d size(std::fabs(scale[0]), std::fabs(scale[1]), std::fabs(scale[2]));
        openvdb::writeString(text, m[0] == m[5] && m[0] == m[10] ? math::UniformScaleTranslateMap::mapType()
                                                                 : math::ScaleTranslateMap::mapType());
        for (const Vec3d &member :
             {axis_of(m, 3), scale, size, inverse, Vec3d(inverse * inverse), Vec3d(inverse / 2.0)}) {
            member.write(text);
        }
    } else {
        openvdb::writeString(text, math::AffineMap::mapType());
        math::Mat4d(m[0], m[4], m[8], 0.0, m[1], m[5], m[9], 0.0, m[2], m[6], m[10], 0.0, m[3], m[7], m[11],
                    1.0)
            .write(text);
    }
    const auto transform = std::make_shared<math::Transform>();
    transform->read(text);
    return transform;
}

} // namespace

FloatGrid::Ptr named_grid(const FloatTree::Ptr &tree, const double *matrix, const std::string &name,
                          openvdb::GridClass grid_class) {
    initialize();
    const FloatGrid::Ptr grid = FloatGrid::create(tree);
    grid->setTransform(make_transform(matrix));
    grid->setName(name);
    grid->setGridClass(grid_class);
    grid->setCreator(std::string("vdbshade ") + vsh_version());
    return grid;
}

FloatGrid::Ptr named_surface(const vsh_grid &grid, const char *name) {
    const FloatGrid::Ptr named =
        named_grid(grid.level_set->treePtr(), grid.info.transform, name, openvdb::GRID_LEVEL_SET);
    if (grid.info.shell_thickness > 0.0) {
        named->insertMeta(SHELL_THICKNESS, openvdb::DoubleMetadata(grid.info.shell_thickness));
    }
    return named;
}

} // namespace vshi

vsh_result vsh_grid_write(const vsh_grid *grid, const char *path, const char *name,
                          const vsh_attribute *attributes, size_t attribute_count, vsh_error *error) {
    VSHI_NEEDS(grid);
    return vshi::write_grids(
        path, grid->info.voxel_size, attributes, attribute_count,
        [&] { return std::vector{vshi::named_surface(*grid, name != nullptr ? name : "surface")}; }, error);
}
