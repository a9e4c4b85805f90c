// Reading .vdb files, in this process or by run.reader: level sets, lists of grids, dense copies.
#include "levelset/file.h"

#include <cstring>
#include <memory>
#include <openvdb/tools/Dense.h>
#include <vector>

namespace vshi {

bool Answer::poll(void *user, double fraction) {
    const Answer &answer = *static_cast<Answer *>(user);
    answer.stage.reach(0.25 * fraction);
    return answer.stage.cancelled();
}

vshi_decoder *Answer::ask(int32_t kind, const char *path, const std::function<void(vshi_encoder *)> &encode,
                          vsh_error *error) {
    const auto request = std::make_unique<vshi_exchange>();
    require(vshi_exchange_begin(request.get(), kind, path, &stage.options, error));
    encode(&request->encoder);
    require(vshi_exchange_send(request.get(), poll, this, &answer, error));
    stage.check();
    return &answer.payload;
}

void end_request(vshi_decoder *request, const char *path, vsh_error *error) {
    if (!vshi_decoder_ends(request)) {
        throw Failure{
            vshi_fail(error, VSH_ERROR_INTERNAL, "%s: the request to its reader does not hold", path)};
    }
}

// --- level sets

vsh_grid *close_level_set(LevelSet &set, Stage &stage, vsh_error *error) {
    stage.check();
    refuse_large(set.named, stage.options, double(set.grid->memUsage()), error);
    const Finding finding = examine_values(*set.grid, stage);
    refuse_bad(set.named, finding, error);
    const std::string name = set.named.text();
    if (finding.kind == Finding::NOTED) {
        vshi_warn(&stage.options, "%s: %s", name.c_str(), finding.text.c_str());
    }
    if (finding.kind == Finding::ODD) {
        vshi_warn(&stage.options, "%s: %s: its distances were made anew", name.c_str(), finding.text.c_str());
        vsh_error why;
        try {
            set.grid = mend(*set.grid, stage, &why);
        } catch (const Failure &failure) {
            if (failure.code != VSH_ERROR_CANCELLED) { // the stage has filled `error`
                vshi_fail(error, failure.code, "%s: %.700s", name.c_str(), why.message);
            }
            throw;
        }
    }
    return close_grid(set.grid, set.shell, stage);
}

namespace {

vsh_grid *read(const char *path, const char *name, const vsh_run &run, vsh_error *error) {
    Stage stage(run, "load", error);
    stage.check();
    LevelSet set{{path, ""}, nullptr, 0.0};
    if (run.reader != nullptr) {
        Answer answer(stage);
        set = take_level_set(
            answer.ask(
                VSHI_READ_GRID, path, [&](vshi_encoder *to) { vshi_encode_text(to, name); }, error),
            path, error);
        set.grid->setGridClass(openvdb::GRID_LEVEL_SET); // which the reader saw
        refuse_bad(set.named, examine_kind(*set.grid), error);
        set.grid->clearGridClass(); // as one that was read here: its mesh is turned by it
    } else {
        set = load_level_set(path, name, stage, error);
    }
    stage.reach(0.3);
    return close_level_set(set, stage, error);
}

// --- lists: plain structs, with texts that end

template <size_t Capacity> bool is_text(const char (&text)[Capacity], bool lines = false) {
    const size_t length = strnlen(text, Capacity);
    const auto is_control = [&](char c) {
        return !(lines && c == '\n') && (static_cast<unsigned char>(c) < 0x20 || c == 0x7f);
    };
    return length < Capacity && std::none_of(text, text + length, is_control);
}

std::vector<vsh_vdb_entry> take_list(vshi_decoder *decoder, const char *path, size_t capacity, size_t *count,
                                     vsh_error *error) {
    const uint64_t all = vshi_decode_count(decoder, UINT32_MAX),
                   listed = vshi_decode_count(decoder, capacity);
    const auto *from =
        static_cast<const vsh_vdb_entry *>(vshi_decode_array(decoder, listed, sizeof(vsh_vdb_entry)));
    if (!vshi_decoder_ends(decoder) || listed > all) {
        throw Failure{vshi_answer_fail(path, "the list's size", error)};
    }
    *count = size_t(all);
    std::vector<vsh_vdb_entry> entries(from, from + listed);
    for (const vsh_vdb_entry &entry : entries) {
        if (!is_text(entry.name) || !is_text(entry.type) || !is_text(entry.grid_class) ||
            !is_text(entry.problem) || !is_text(entry.attributes, true)) {
            throw Failure{vshi_answer_fail(path, "a text", error)};
        }
    }
    return entries;
}

void list(const char *path, const vsh_run &run, vsh_vdb_entry *entries, size_t capacity, size_t *count,
          vsh_error *error) {
    std::vector<vsh_vdb_entry> found;
    if (run.reader != nullptr) {
        Stage stage(run, "load", error);
        Answer answer(stage);
        found = take_list(
            answer.ask(
                VSHI_READ_LIST, path, [&](vshi_encoder *to) { vshi_encode_count(to, capacity); }, error),
            path, capacity, count, error);
    } else {
        *count = list_grids(path, run, found, capacity, error);
    }
    std::copy(found.begin(), found.end(), entries);
}

// --- dense copies

using Dense = openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ>; // x fastest, as in pictures

struct CopyGrid {
    const openvdb::CoordBBox &box;
    float *values;
    float *active;

    template <typename GridType> void operator()(const GridType &grid) const {
        const auto &tree = grid.constTree();
        if constexpr (std::is_same_v<GridType, openvdb::MaskGrid>) {
            copy_active(tree, values);
        } else if (values != nullptr) {
            Dense dense(box, values);
            openvdb::tools::copyToDense(tree, dense, true);
        }
        copy_active(tree, active);
    }

    template <typename Tree> void copy_active(const Tree &tree, float *to) const {
        if (to != nullptr) {
            Dense dense(box, to);
            openvdb::tools::copyToDense(openvdb::BoolTree(tree, false, true, openvdb::TopologyCopy()), dense,
                                        true);
        }
    }
};

// A box of a grid to copy.
struct Wanted {
    const char *path, *name;
    int32_t low[3], size[3];

    size_t count() const { return size_t(size[0]) * size_t(size[1]) * size_t(size[2]); }
};

openvdb::CoordBBox box_of(const Wanted &wanted, vsh_error *error) {
    const int32_t *size = wanted.size;
    const openvdb::CoordBBox box = box_to_copy(wanted.low, size, error);
    if (double(size[0]) * double(size[1]) * double(size[2]) > double(INT32_MAX)) {
        throw Failure{vshi_fail(error, VSH_ERROR_ARGUMENT,
                                "copy of %d × %d × %d voxels: expected up to 2^31 - 1", size[0], size[1],
                                size[2])};
    }
    return box;
}

void copy(const Wanted &wanted, const vsh_run &run, float *values, float *active, vsh_error *error) {
    const openvdb::CoordBBox box = box_of(wanted, error);
    Stage stage(run, "load", error);
    stage.check();
    if (run.reader == nullptr) {
        const openvdb::GridBase::Ptr grid = read_numbers(wanted.path, wanted.name, run, error);
        stage.check();
        grid->apply<NumberGrids>(CopyGrid{box, values, active});
        return;
    }
    Answer answer(stage);
    const auto encode = [&](vshi_encoder *to) {
        vshi_encode_text(to, wanted.name);
        vshi_encode_array(to, wanted.low, 3, sizeof wanted.low[0]);
        vshi_encode_array(to, wanted.size, 3, sizeof wanted.size[0]);
        vshi_encode_count(to, values != nullptr);
        vshi_encode_count(to, active != nullptr);
    };
    vshi_decoder *payload = answer.ask(VSHI_READ_COPY, wanted.path, encode, error);
    for (float *to : {values, active}) {
        const void *from = to != nullptr ? vshi_decode_array(payload, wanted.count(), sizeof *to) : nullptr;
        if (from != nullptr) {
            std::memcpy(to, from, wanted.count() * sizeof *to);
        }
    }
    if (!vshi_decoder_ends(payload)) {
        throw Failure{vshi_answer_fail(wanted.path, "the copy's size", error)};
    }
}

// The body of a public call, or of a reader's.
template <typename Body>
vsh_result call(const vsh_run *run, const char *path, vsh_error *error, const Body &body) {
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    return guard(error, VSH_ERROR_READ, path, [&] {
        body(full);
        return VSH_OK;
    });
}

} // namespace

} // namespace vshi

vsh_result vshi_serve_grid(const char *path, vshi_decoder *request, const vsh_run *run, vshi_encoder *payload,
                           vsh_error *error) {
    return vshi::call(run, path, error, [&](const vsh_run &full) {
        const char *name = vshi_decode_text(request, false);
        vshi::end_request(request, path, error);
        vshi::Stage stage(full, "load", error);
        vshi::put_level_set(payload, vshi::load_level_set(path, name, stage, error));
    });
}

vsh_result vshi_serve_list(const char *path, vshi_decoder *request, const vsh_run *run, vshi_encoder *payload,
                           vsh_error *error) {
    return vshi::call(run, path, error, [&](const vsh_run &full) {
        const uint64_t capacity = vshi_decode_count(request, UINT64_MAX);
        vshi::end_request(request, path, error);
        std::vector<vsh_vdb_entry> found;
        vshi_encode_count(payload, vshi::list_grids(path, full, found, capacity, error));
        vshi_encode_count(payload, found.size());
        vshi_encode_array(payload, found.data(), found.size(), sizeof(vsh_vdb_entry));
    });
}

vsh_result vshi_serve_copy(const char *path, vshi_decoder *request, const vsh_run *run, vshi_encoder *payload,
                           vsh_error *error) {
    return vshi::call(run, path, error, [&](const vsh_run &full) {
        vshi::Wanted wanted{path, vshi_decode_text(request, false), {}, {}};
        for (int32_t *to : {wanted.low, wanted.size}) {
            const void *from = vshi_decode_array(request, 3, sizeof *to);
            if (from != nullptr) {
                std::memcpy(to, from, 3 * sizeof *to);
            }
        }
        bool has[2];
        for (bool &one : has) {
            one = vshi_decode_count(request, 1) != 0;
        }
        vshi::end_request(request, path, error);
        vshi::box_of(wanted, error); // before memory is taken
        std::vector<float> values(has[0] ? wanted.count() : 0), active(has[1] ? wanted.count() : 0);
        vshi::copy(wanted, full, has[0] ? values.data() : nullptr, has[1] ? active.data() : nullptr, error);
        vshi_encode_array(payload, values.data(), values.size(), sizeof(float));
        vshi_encode_array(payload, active.data(), active.size(), sizeof(float));
    });
}

vsh_result vsh_grid_read(const char *path, const char *name, const vsh_run *run, vsh_grid **grid,
                         vsh_error *error) {
    VSHI_NEEDS(grid);
    *grid = nullptr;
    VSHI_NEEDS(path);
    return vshi::call(run, path, error,
                      [&](const vsh_run &full) { *grid = vshi::read(path, name, full, error); });
}

vsh_result vsh_vdb_list(const char *path, const vsh_run *run, vsh_vdb_entry *entries, size_t capacity,
                        size_t *count, vsh_error *error) {
    VSHI_NEEDS(count);
    *count = 0;
    VSHI_NEEDS(path);
    VSHI_NEEDS_OF(capacity, entries);
    return vshi::call(run, path, error,
                      [&](const vsh_run &full) { vshi::list(path, full, entries, capacity, count, error); });
}

vsh_result vsh_vdb_copy(const char *path, const char *name, const int32_t index_min[3], const int32_t size[3],
                        const vsh_run *run, float *values, float *active, vsh_error *error) {
    VSHI_NEEDS(path);
    VSHI_NEEDS(index_min);
    VSHI_NEEDS(size);
    return vshi::call(run, path, error, [&](const vsh_run &full) {
        const vshi::Wanted wanted{
            path, name, {index_min[0], index_min[1], index_min[2]}, {size[0], size[1], size[2]}};
        vshi::copy(wanted, full, values, active, error);
    });
}
