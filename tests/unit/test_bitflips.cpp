// Reads level sets with changed bits, in each compression, by a reader: no crash comes here, and a change
// that makes values jump is refused or comes with a warning.
#include "readers.h"

namespace {

constexpr int TRIED = 20;         // of each sample
constexpr float TOO_STEEP = 2.5f; // voxels, from a voxel to the next

struct Sample {
    uint32_t compression;
    bool half;
};

const Sample samples[] = {
    {openvdb::io::COMPRESS_NONE, false},
    {openvdb::io::COMPRESS_NONE, true},
    {openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK, false},
    {openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK, true},
    {openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK, false},
    {openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK, true},
};

struct Tally {
    int stopped = 0; // reads that fail
    int same = 0;    // the sound grid, read without a warning
    int jumps = 0;   // grids with a jump of values, read without a warning
};

std::string mutate(std::string bytes, uint64_t seed) {
    uint64_t state = seed * 0x9e3779b97f4a7c15u + 1;
    const auto next = [&](uint64_t most) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        return (state >> 33) % most;
    };
    for (uint64_t k = next(4) + 1; k > 0; --k) {
        const size_t reach = next(4) == 0 ? std::min<size_t>(bytes.size(), 1024) : bytes.size();
        const size_t at = next(reach);
        switch (next(8)) {
        case 0: // a byte
            bytes[at] = char(next(256));
            break;
        case 1: // a number at one of its ends
            std::memset(&bytes[at], next(2) == 0 ? 0 : 0xff,
                        std::min<size_t>(next(8) + 1, bytes.size() - at));
            break;
        default:
            bytes[at] = char(bytes[at] ^ (1 << next(8)));
        }
    }
    return bytes;
}

float value_at(const vsh_grid *grid, const openvdb::Coord &at) {
    return grid->level_set->constTree().getValue(at);
}

// Compares a grid that was read without a warning with the sound one.
void compare(const vsh_grid *sound, const vsh_grid *read, Tally &tally) {
    if (std::memcmp(sound->info.transform, read->info.transform, sizeof read->info.transform) != 0) {
        return;
    }
    const float voxel = float(read->info.voxel_size), background = read->level_set->background();
    bool changed = background != sound->level_set->background(), jump = false;
    for (const vsh_grid *one : {sound, read}) {
        for (const vshi_leaf &leaf : leaves_of(one)) {
            for (int v = 0; v < 512; ++v) {
                const openvdb::Coord at(leaf.origin[0] + v / 64, leaf.origin[1] + v / 8 % 8,
                                        leaf.origin[2] + v % 8);
                const float b = value_at(read, at);
                assert_true(std::isfinite(b) && std::fabs(b) <= background);
                changed |= value_at(sound, at) != b;
                for (int axis = 0; axis < 3; ++axis) {
                    openvdb::Coord beside = at;
                    ++beside[axis];
                    const float c = value_at(read, beside), step = std::fabs(b - c);
                    const bool whole = std::fabs(b) < background && std::fabs(c) < background;
                    jump |= (whole && step > TOO_STEEP * voxel) ||
                            (std::signbit(b) != std::signbit(c) && step > 4.5f * voxel);
                }
            }
        }
    }
    tally.same += !changed;
    tally.jumps += jump;
}

void run_one(const std::string &path, const vsh_grid *sound, Tally &tally) {
    vsh_run run = with_reader();
    run.memory_limit = 500000000;
    run.reader_seconds = 30.0;
    warned.clear();
    OWNED(vsh_grid) *grid = nullptr;
    const vsh_result result = vsh_grid_read(path.c_str(), nullptr, &run, &grid, &failure);
    if (result != VSH_OK) {
        assert_true(result == VSH_ERROR_READ || result == VSH_ERROR_INPUT || result == VSH_ERROR_LIMIT);
        tally.stopped += result != VSH_ERROR_LIMIT;
    } else if (warned.empty()) {
        compare(sound, grid, tally);
    }
}

void run_sample(const Sample &sample, uint64_t first, Tally &tally) {
    const std::string path = in_folder("sound.vdb"), damaged = in_folder("damaged.vdb");
    const FloatGrid::Ptr grid = sphere();
    grid->setSaveFloatAsHalf(sample.half);
    // OpenVDB packs no level sets with Zip; other writers may, so this one is no level set until it is
    // written
    constexpr const char *CLASS = "level set", *OTHER = "level_set";
    grid->insertMeta(openvdb::GridBase::META_GRID_CLASS, openvdb::StringMetadata(OTHER));
    openvdb::io::File file(path);
    file.setCompression(sample.compression);
    file.write(openvdb::GridPtrVec{grid});
    file.close();
    std::string bytes = content(path);
    bytes.replace(bytes.find(OTHER), std::strlen(CLASS), CLASS);
    put(path, bytes);
    OWNED(vsh_grid) *sound = nullptr;
    assert_int_equal(vsh_grid_read(path.c_str(), nullptr, nullptr, &sound, &failure), VSH_OK);
    for (int i = 0; i < TRIED; ++i) {
        put(damaged, mutate(bytes, first + uint64_t(i)));
        run_one(damaged, sound, tally);
    }
}

TEST(changed_bits_never_reach_the_caller_and_are_told_where_they_can_be) {
    Tally tally;
    for (size_t i = 0; i < sizeof samples / sizeof samples[0]; ++i) {
        run_sample(samples[i], 1000000 * i, tally);
    }
    assert_int_equal(tally.jumps, 0);
    assert_true(tally.stopped > 0 && tally.same > 0); // or the damage is none
}

} // namespace

int main(int argc, char **argv) {
    const int served = as_reader(argc, argv);
    if (served >= 0) {
        _exit(served);
    }
    if (!make_folder()) {
        return 1;
    }
    return run_all_tests(nullptr, remove_folder);
}
