/* What parts have measured, put together: nothing is believed of it that the scene does not bear out. */
#include "base/memory.h"
#include "base/try.h"
#include "cli/message.h"
#include "cli/try.h"
#include "part.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A time that nothing here takes. */
static const double MOST_SECONDS = 1e9;

typedef struct merging {
    trade_work *work;
    vsh_part_options parts;
    trade_run *runs;  /* [task_count]: of each task, without values where there is none */
    bool *taken;      /* [task_count] */
    int32_t shard;    /* that is read */
    trade_head first; /* of the first part: the others say the same of what they share */
    double held;      /* bytes of values so far */
} merging;

/* --- the head */

static vsh_result differs(const char *path, const char *what, uint64_t theirs, uint64_t ours,
                          vsh_error *error) {
    char was[32], is[32];
    snprintf(was, sizeof was, "%" PRIu64, theirs);
    snprintf(is, sizeof is, "%" PRIu64, ours);
    return vshi_part_refuse(path, what, was, is, error);
}

/* What all parts share, and this process knows of. */
static vsh_result check_shared(const merging *m, const trade_head *head, const char *path, vsh_error *error) {
    const trade_work *work = m->work;
    const struct {
        const char *what;
        uint64_t theirs, ours;
    } shared[] = {
        {"number of texels", head->texels, work->texels},
        {"number of covered texels", head->covered, work->covered},
        {"number of voxel sizes", head->fields, work->field_count},
        {"answer to whether all casters are traced", (uint64_t)head->meshes, work->meshes},
        {"number of threads", (uint64_t)head->threads, (uint64_t)m->first.threads},
        {"number of runs", head->tasks, work->task_count},
    };
    for (size_t i = 0; i < sizeof shared / sizeof shared[0]; ++i) {
        if (shared[i].theirs != shared[i].ours) {
            return differs(path, shared[i].what, shared[i].theirs, shared[i].ours, error);
        }
    }
    return VSH_OK;
}

static bool is_time(double seconds) {
    return seconds >= 0.0 && seconds < MOST_SECONDS;
}

static bool is_share(double share) {
    return isnan(share) || (share >= 0.0 && share <= 1.0);
}

static bool can_be(const trade_work *work, const trade_task *task, const trade_record *record) {
    return task->kind == TRADE_TRUTH ||
           (is_time(record->build_s) && is_time(record->bake_s) && record->bake_s > 0.0 &&
            is_share(record->certified) && record->valid > 0 && record->valid <= work->covered);
}

/* Whether the records are of tasks that are the part's, each once, with numbers that can be; and what they
 * and the masks take is what the body has. */
static vsh_result check_records(const merging *m, const vshi_part_input *part, const trade_head *head,
                                vsh_error *error) {
    const trade_work *work = m->work;
    uint64_t bytes = (uint64_t)work->texels * sizeof(uint32_t), own = 0, next = 0;
    for (size_t t = 0; t < work->task_count; ++t) {
        own += work->tasks[t].shard == m->shard;
    }
    for (uint64_t i = 0; i < head->record_count; ++i) {
        const trade_record *record = &head->records[i];
        const trade_task *task = record->task < work->task_count ? &work->tasks[record->task] : NULL;
        if (task == NULL || record->task < next || task->shard != m->shard || !can_be(work, task, record)) {
            return vshi_part_damaged(part->path, "its runs", error);
        }
        bytes += trade_values_bytes(work, task) + trade_mask_bytes(work, task);
        next = record->task + 1;
    }
    if (!is_time(head->truth_s) || head->record_count > own || head->skipped != own - head->record_count) {
        return vshi_part_damaged(part->path, "its runs", error);
    }
    return part->front.body_bytes == bytes && part->front.tail_bytes == 0
               ? VSH_OK
               : vshi_part_damaged(part->path, "it has not the size that its runs take", error);
}

/* --- the body */

/* The first part's masks are taken, and the others' are the same. */
static vsh_result take_masks(const merging *m, FILE *file, const char *path, vsh_error *error) {
    trade_work *work = m->work;
    uint32_t words[4096];
    const size_t most = sizeof words / sizeof words[0];
    for (size_t first = 0; first < work->texels; first += most) {
        const size_t count = work->texels - first < most ? work->texels - first : most;
        VSHI_TRY(vshi_part_read_bytes(file, path, words, count * sizeof words[0], error));
        for (size_t i = 0; i < count * work->field_count; ++i) {
            const size_t f = i % work->field_count, texel = first + i / work->field_count;
            const uint8_t valid = words[i / work->field_count] >> f & 1;
            if (m->shard > 1 && work->fields[f].mask[texel] != valid) {
                return vshi_fail(error, VSH_ERROR_INPUT,
                                 "%s: found texel %zu %s at %d voxels, unlike the part before it: is it of "
                                 "the same build? bake this part again",
                                 path, texel, valid != 0 ? "valid" : "invalid", work->fields[f].resolution);
            }
            work->fields[f].mask[texel] = valid;
        }
    }
    return VSH_OK;
}

/* Values out of a part, in memory of their own. */
static vsh_result take(merging *m, void **memory, uint64_t bytes, FILE *file, const char *path,
                       vsh_error *error) {
    m->held += (double)bytes;
    VSHI_TRY(vshi_check_limit(&m->work->run, m->held, m->parts.parts, error));
    *memory = malloc((size_t)bytes);
    return *memory != NULL
               ? vshi_part_read_bytes(file, path, *memory, (size_t)bytes, error)
               : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", m->parts.parts);
}

static vsh_result take_truth(merging *m, const trade_task *task, FILE *file, const char *path,
                             vsh_error *error) {
    trade_work *work = m->work;
    for (size_t s = 0; s < work->subject_count; ++s) {
        trade_subject *subject = &work->subjects[s];
        const uint64_t bytes = (uint64_t)subject->planes * work->texels * sizeof(float);
        if (task->subject == s || task->subject == work->subject_count) {
            VSHI_TRY(take(m, (void **)&subject->truth, bytes, file, path, error));
        }
    }
    return VSH_OK;
}

static vsh_result take_run(merging *m, const trade_record *record, FILE *file, const char *path,
                           vsh_error *error) {
    const trade_task *task = &m->work->tasks[record->task];
    const uint64_t mask = trade_mask_bytes(m->work, task);
    trade_run *run = &m->runs[record->task];
    run->task = (size_t)record->task;
    run->build_s = record->build_s;
    run->bake_s = record->bake_s;
    run->certified = record->certified;
    run->bytes = record->bytes;
    run->valid = (size_t)record->valid;
    VSHI_TRY(take(m, (void **)&run->values, trade_values_bytes(m->work, task), file, path, error));
    return mask > 0 ? take(m, (void **)&run->mask, mask, file, path, error) : VSH_OK;
}

static vsh_result take_body(merging *m, const vshi_part_input *part, const trade_head *head,
                            vsh_error *error) {
    FILE *file;
    VSHI_TRY(vshi_part_reopen(part->path, sizeof part->front + part->front.head_bytes, &file, error));
    vsh_result result = take_masks(m, file, part->path, error);
    for (uint64_t i = 0; i < head->record_count && result == VSH_OK; ++i) {
        const trade_record *record = &head->records[i];
        const trade_task *task = &m->work->tasks[record->task];
        result = task->kind == TRADE_TRUTH ? take_truth(m, task, file, part->path, error)
                                           : take_run(m, record, file, part->path, error);
        m->taken[record->task] = true;
    }
    fclose(file);
    return result;
}

/* --- a part */

static vsh_result take_part(merging *m, const char *path, vsh_error *error) {
    trade_work *work = m->work;
    vshi_part_input part;
    vshi_part_about about;
    trade_head head = {.records = NULL};
    vsh_result result;
    VSHI_TRY_DONE(vshi_part_input_open(path, &work->run, &part, &about, error));
    VSHI_TRY_DONE(vshi_part_about_check(&about, path, TRADE_PART, m->shard, &m->parts, error));
    trade_head_code(&part.head, &head);
    VSHI_TRY_DONE(vshi_part_input_end_head(&part, error));
    if (m->shard == 1) {
        m->first = head;
        m->first.records = NULL;
    }
    VSHI_TRY_DONE(check_shared(m, &head, path, error));
    VSHI_TRY_DONE(check_records(m, &part, &head, error));
    VSHI_TRY_DONE(vshi_part_input_pass_body(&part, true, &work->run, error));
    VSHI_TRY_DONE(vshi_part_input_check_sum(&part, error));
    VSHI_TRY_DONE(take_body(m, &part, &head, error));
    work->skipped += (size_t)head.skipped;
    work->truth_s += head.truth_s;
done:
    free(head.records);
    vshi_part_about_free(&about);
    vshi_part_input_close(&part);
    return result;
}

static int take_all(merging *m) {
    vsh_error error;
    for (m->shard = 1; m->shard <= m->parts.shard_count; ++m->shard) {
        char *path = vshi_part_path(m->parts.parts, m->shard, m->parts.shard_count);
        if (path == NULL) {
            return cli_out_of_memory("parts");
        }
        const vsh_result result = take_part(m, path, &error);
        free(path);
        if (result != VSH_OK) {
            return cli_fail(&error);
        }
    }
    return CLI_OK;
}

/* --- all of them */

static int make_room(merging *m) {
    trade_work *work = m->work;
    m->runs = calloc(work->task_count, sizeof *m->runs);
    m->taken = calloc(work->task_count, sizeof *m->taken);
    for (size_t f = 0; f < work->field_count; ++f) {
        work->fields[f].mask = calloc(work->texels, 1);
        if (work->fields[f].mask == NULL) {
            return cli_out_of_memory("coverage");
        }
    }
    return m->runs != NULL && m->taken != NULL ? CLI_OK : cli_out_of_memory("runs");
}

/* In the order of the tasks, which is that of an unshared trade. */
static int add_runs(merging *m) {
    trade_work *work = m->work;
    for (size_t s = 0; s < work->subject_count; ++s) {
        if (work->subjects[s].truth == NULL) {
            cli_say("%s: damaged: its parts have no truth; bake them again", m->parts.parts);
            return CLI_USAGE;
        }
    }
    for (size_t t = 0; t < work->task_count; ++t) {
        if (m->taken[t] && work->tasks[t].kind != TRADE_TRUTH) {
            trade_run *run = &m->runs[t];
            const trade_kind kind = work->tasks[t].kind;
            run->valid = kind == TRADE_EMBREE   ? work->points
                         : kind == TRADE_METHOD ? work->fields[work->tasks[t].field].valid
                                                : run->valid;
            trade_name_run(work, run);
            CLI_TRY(trade_add(work, run));
            run->values = NULL;
            run->mask = NULL;
        }
    }
    return CLI_OK;
}

static int merge(merging *m) {
    trade_work *work = m->work;
    CLI_TRY(trade_list_tasks(work));
    CLI_TRY(make_room(m));
    CLI_TRY(take_all(m));
    CLI_TRY(trade_join_masks(work));
    work->threads = m->first.threads;
    return add_runs(m);
}

int trade_take_parts(trade_work *work) {
    merging m = {.work = work};
    cli_provenance origin = {NULL, NULL, 0};
    int code;
    CLI_TRY_DONE(trade_part_options(work, &origin, &m.parts));
    code = merge(&m);
done:
    for (size_t t = 0; m.runs != NULL && t < work->task_count; ++t) {
        free(m.runs[t].values);
        free(m.runs[t].mask);
    }
    free(m.runs);
    free(m.taken);
    cli_provenance_free(&origin);
    return code;
}
