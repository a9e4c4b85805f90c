// vsh_grid_read() and vsh_vdb_list(): a file's content, from this process or from a reader, looked over.
#include "base/try.h"
#include "levelset/file.h"
#include "levelset/message.h"

#include <cmath>
#include <cstring>
#include <memory>

namespace vshi {

namespace {

FloatGrid::Ptr mend_named(const Named &named, const FloatGrid &grid, Stage &stage, vsh_error *error) {
    vsh_error why;
    try {
        return mend(grid, stage, &why);
    } catch (const Failure &failure) {
        if (failure.code != VSH_ERROR_CANCELLED) { // which the stage has told already
            vshi_fail(error, failure.code, "%s: %.700s", named.text().c_str(), why.message);
        }
        throw;
    }
}

} // namespace

vsh_grid *close_level_set(LevelSet &set, Stage &stage, vsh_error *error) {
    stage.check();
    refuse_large(set.named, stage.options, double(set.grid->memUsage()), error);
    const Finding finding = examine_values(*set.grid, stage);
    refuse_bad(set.named, finding, error);
    if (finding.kind == Finding::NOTED) {
        vshi_warn(&stage.options, "%s: %s", set.named.text().c_str(), finding.text.c_str());
    }
    if (finding.kind == Finding::ODD) {
        vshi_warn(&stage.options, "%s: %s: its distances were made anew", set.named.text().c_str(),
                  finding.text.c_str());
        set.grid = mend_named(set.named, *set.grid, stage, error);
    }
    return close_grid(set.grid, set.shell, stage);
}

namespace {

bool poll_stage(void *user, double fraction) {
    Stage &stage = *static_cast<Stage *>(user);
    stage.reach(0.25 * fraction);
    return stage.cancelled();
}

// An answer that goes when it goes out of scope.
class Answer {
  public:
    Answer() = default;
    ~Answer() { vshi_answer_free(&answer); }
    Answer(const Answer &) = delete;
    Answer &operator=(const Answer &) = delete;

    vshi_decoder *ask(int32_t kind, const char *path, const char *name, uint64_t number, Stage &stage,
                      vsh_error *error) {
        const auto request = std::make_unique<vshi_exchange>();
        require(vshi_exchange_begin(request.get(), kind, path, &stage.options, error));
        vshi_encode_text(&request->encoder, name);
        vshi_encode_count(&request->encoder, number);
        require(vshi_exchange_send(request.get(), poll_stage, &stage, &answer, error));
        return &answer.payload;
    }

  private:
    vshi_answer answer{nullptr, 0, 0, {nullptr, nullptr, true}};
};

vsh_result read(const char *path, const char *name, const vsh_run &run, vsh_grid **grid, vsh_error *error) {
    Stage stage(run, "load", error);
    stage.check();
    LevelSet set{{path, ""}, nullptr, 0.0};
    if (run.reader != nullptr) {
        Answer answer;
        set = take_level_set(answer.ask(VSHI_READ_GRID, path, name, 0, stage, error), path, error);
        set.grid->setGridClass(openvdb::GRID_LEVEL_SET); // which the reader saw
        refuse_bad(set.named, examine_kind(*set.grid), error);
        set.grid->clearGridClass(); // as one that was read here: its mesh is turned by it
    } else {
        set = load_level_set(path, name, stage, error);
    }
    stage.reach(0.3);
    *grid = close_level_set(set, stage, error);
    return VSH_OK;
}

// --- lists: plain structs, with texts that end

template <size_t Capacity> bool is_text(const char (&text)[Capacity], bool lines = false) {
    const size_t length = strnlen(text, Capacity);
    for (size_t i = 0; i < length; ++i) {
        const bool end = lines && text[i] == '\n';
        if (!end && (static_cast<unsigned char>(text[i]) < 0x20 || text[i] == 0x7f)) {
            return false;
        }
    }
    return length < Capacity;
}

void take_list(vshi_decoder *decoder, const char *path, std::vector<vsh_vdb_entry> &entries, size_t capacity,
               size_t &count, vsh_error *error) {
    const uint64_t all = vshi_decode_count(decoder, UINT32_MAX),
                   listed = vshi_decode_count(decoder, capacity);
    const void *from = vshi_decode_array(decoder, listed, sizeof(vsh_vdb_entry));
    if (!vshi_decoder_ends(decoder) || listed > all) {
        throw Failure{vshi_answer_fail(path, "the list's size", error)};
    }
    entries.resize(size_t(listed));
    if (listed > 0) {
        std::memcpy(entries.data(), from, size_t(listed) * sizeof(vsh_vdb_entry));
    }
    for (const vsh_vdb_entry &entry : entries) {
        if (!is_text(entry.name) || !is_text(entry.type) || !is_text(entry.grid_class) ||
            !is_text(entry.problem) || !is_text(entry.attributes, true)) {
            throw Failure{vshi_answer_fail(path, "a text", error)};
        }
    }
    count = size_t(all);
}

vsh_result list(const char *path, const vsh_run &run, vsh_vdb_entry *entries, size_t capacity, size_t *count,
                vsh_error *error) {
    std::vector<vsh_vdb_entry> found;
    if (run.reader != nullptr) {
        Stage stage(run, "load", error);
        Answer answer;
        take_list(answer.ask(VSHI_READ_LIST, path, nullptr, capacity, stage, error), path, found, capacity,
                  *count, error);
    } else {
        list_grids(path, run, found, capacity, *count, error);
    }
    std::copy(found.begin(), found.end(), entries);
    return VSH_OK;
}

template <typename Body>
vsh_result call(const vsh_run *run, const char *path, vsh_error *error, Body &&body) {
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    return guard(error, VSH_ERROR_READ, path, [&] { return body(full); });
}

// What follows the path in every request of this file.
struct Wanted {
    const char *name;
    uint64_t number; // of entries, for a list

    Wanted(vshi_decoder *request, const char *path, vsh_error *error)
        : name(vshi_decode_text(request, false)), number(vshi_decode_count(request, UINT64_MAX)) {
        if (!vshi_decoder_ends(request)) {
            throw Failure{
                vshi_fail(error, VSH_ERROR_INTERNAL, "%s: the request to its reader does not hold", path)};
        }
    }
};

} // namespace

} // namespace vshi

vsh_result vshi_serve_grid(const char *path, vshi_decoder *request, const vsh_run *run, vshi_encoder *payload,
                           vsh_error *error) {
    return vshi::guard(error, VSH_ERROR_READ, path, [&]() -> vsh_result {
        const vshi::Wanted wanted(request, path, error);
        vshi::Stage stage(*run, "load", error);
        vshi::put_level_set(payload, vshi::load_level_set(path, wanted.name, stage, error));
        return VSH_OK;
    });
}

vsh_result vshi_serve_list(const char *path, vshi_decoder *request, const vsh_run *run, vshi_encoder *payload,
                           vsh_error *error) {
    return vshi::guard(error, VSH_ERROR_READ, path, [&]() -> vsh_result {
        const vshi::Wanted wanted(request, path, error);
        std::vector<vsh_vdb_entry> found;
        size_t count = 0;
        vshi::list_grids(path, *run, found, wanted.number, count, error);
        vshi_encode_count(payload, count);
        vshi_encode_count(payload, found.size());
        vshi_encode_array(payload, found.data(), found.size(), sizeof(vsh_vdb_entry));
        return VSH_OK;
    });
}

vsh_result vsh_grid_read(const char *path, const char *name, const vsh_run *run, vsh_grid **grid,
                         vsh_error *error) {
    VSHI_NEEDS(grid);
    *grid = nullptr;
    VSHI_NEEDS(path);
    return vshi::call(run, path, error,
                      [&](const vsh_run &full) { return vshi::read(path, name, full, grid, error); });
}

vsh_result vsh_vdb_list(const char *path, const vsh_run *run, vsh_vdb_entry *entries, size_t capacity,
                        size_t *count, vsh_error *error) {
    VSHI_NEEDS(count);
    *count = 0;
    VSHI_NEEDS(path);
    VSHI_NEEDS_OF(capacity, entries);
    return vshi::call(run, path, error, [&](const vsh_run &full) {
        return vshi::list(path, full, entries, capacity, count, error);
    });
}
