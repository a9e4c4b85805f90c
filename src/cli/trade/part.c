/* --shard: what was measured, kept for merging. */
#include "part.h"
#include "cli/message.h"
#include "cli/temporary.h"
#include "cli/try.h"

#include <stdlib.h>
#include <string.h>

enum { RECORD_BYTES = 6 * 8, WORDS = 4096 };

static void code_record(vshi_part_code *code, trade_record *record) {
    vshi_part_code_u64(code, &record->task);
    vshi_part_code_f64(code, &record->build_s);
    vshi_part_code_f64(code, &record->bake_s);
    vshi_part_code_f64(code, &record->certified);
    vshi_part_code_u64(code, &record->bytes);
    vshi_part_code_u64(code, &record->valid);
}

void trade_head_code(vshi_part_code *code, trade_head *head) {
    vshi_part_code_i32(code, &head->threads);
    vshi_part_code_i32(code, &head->meshes);
    vshi_part_code_u64(code, &head->tasks);
    vshi_part_code_u64(code, &head->texels);
    vshi_part_code_u64(code, &head->covered);
    vshi_part_code_u64(code, &head->fields);
    vshi_part_code_u64(code, &head->skipped);
    vshi_part_code_f64(code, &head->truth_s);
    vshi_part_code_count(code, &head->record_count, RECORD_BYTES, (void **)&head->records,
                         sizeof *head->records);
    for (uint64_t i = 0; i < head->record_count && !code->failed; ++i) {
        code_record(code, &head->records[i]);
    }
}

int trade_part_options(const trade_work *work, cli_provenance *origin, vsh_part_options *options) {
    const cli_bake_settings *s = &work->settings->bake;
    const char *const files[] = {s->input, cli_bake_lights(s)};
    CLI_TRY(cli_provenance_make(work->scene, files, 2, NULL, &work->run, origin));
    *options = vsh_part_options_default();
    options->parts = work->settings->report;
    options->shard = s->shard;
    options->shard_count = s->shard_count;
    options->attributes = origin->attributes;
    options->attribute_count = origin->count;
    options->words = s->words;
    options->word_count = s->word_count;
    return CLI_OK;
}

/* --- what is to be kept */

static const trade_run *run_of(const trade_work *work, size_t task) {
    const trade_subject *subject = &work->subjects[work->tasks[task].subject];
    for (size_t i = 0; i < subject->run_count; ++i) {
        if (subject->runs[i].task == task) {
            return &subject->runs[i];
        }
    }
    return NULL; /* it did not fit into the budget */
}

static int list_records(const trade_work *work, trade_head *head) {
    head->records = calloc(work->task_count, sizeof *head->records);
    if (head->records == NULL) {
        return cli_out_of_memory("part");
    }
    for (size_t t = 0; t < work->task_count; ++t) {
        const bool ours = trade_is_ours(work, &work->tasks[t]), truth = work->tasks[t].kind == TRADE_TRUTH;
        const trade_run *run = ours && !truth ? run_of(work, t) : NULL;
        if (ours && truth) {
            head->records[head->record_count++] = (trade_record){.task = t};
        } else if (run != NULL) {
            head->records[head->record_count++] =
                (trade_record){t, run->build_s, run->bake_s, run->certified, run->bytes, run->valid};
        }
    }
    return CLI_OK;
}

static uint64_t body_bytes(const trade_work *work, const trade_head *head) {
    uint64_t bytes = (uint64_t)work->texels * sizeof(uint32_t);
    for (uint64_t i = 0; i < head->record_count; ++i) {
        const trade_task *task = &work->tasks[head->records[i].task];
        bytes += trade_values_bytes(work, task) + trade_mask_bytes(work, task);
    }
    return bytes;
}

/* --- writing */

static void put_masks(const trade_work *work, vshi_part_output *part) {
    uint32_t words[WORDS];
    for (size_t first = 0; first < work->texels; first += WORDS) {
        const size_t count = work->texels - first < WORDS ? work->texels - first : WORDS;
        for (size_t i = 0; i < count; ++i) {
            words[i] = 0;
            for (size_t f = 0; f < work->field_count; ++f) {
                words[i] |= (uint32_t)work->fields[f].mask[first + i] << f;
            }
        }
        vshi_part_output_put(part, words, count * sizeof words[0]);
    }
}

static void put_truth(const trade_work *work, const trade_task *task, vshi_part_output *part) {
    for (size_t s = 0; s < work->subject_count; ++s) {
        const trade_subject *subject = &work->subjects[s];
        if (task->subject == s || task->subject == work->subject_count) {
            vshi_part_output_put(part, subject->truth, subject->planes * work->texels * sizeof(float));
        }
    }
}

static void put_run(const trade_work *work, const trade_task *task, const trade_run *run,
                    vshi_part_output *part) {
    static const uint8_t zeros[4] = {0};
    const size_t whole = work->texels / 4 * 4, rest = work->texels - whole;
    vshi_part_output_put(part, run->values, (size_t)trade_values_bytes(work, task));
    if (task->kind == TRADE_AUTO) {
        uint8_t last[4];
        memcpy(last, zeros, sizeof last);
        memcpy(last, run->mask + whole, rest);
        vshi_part_output_put(part, run->mask, whole);
        vshi_part_output_put(part, last, rest > 0 ? sizeof last : 0);
    }
}

static int write(const trade_work *work, const char *path, trade_head *head, vshi_part_about *about) {
    vshi_part_code code = {.reads = false};
    vshi_part_output part;
    vsh_error error;
    vshi_part_about_code(&code, about);
    trade_head_code(&code, head);
    if (vshi_part_output_begin(&part, path, &code, body_bytes(work, head), 0, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    put_masks(work, &part);
    for (uint64_t i = 0; i < head->record_count; ++i) {
        const size_t at = (size_t)head->records[i].task;
        const trade_task *task = &work->tasks[at];
        if (task->kind == TRADE_TRUTH) {
            put_truth(work, task, &part);
        } else {
            put_run(work, task, run_of(work, at), &part);
        }
    }
    return vshi_part_output_finish(&part, &error) == VSH_OK ? CLI_OK : cli_fail(&error);
}

static char *path_of(const trade_settings *s) {
    return vshi_part_path(s->report, s->bake.shard, s->bake.shard_count);
}

int trade_check_part(const trade_settings *settings) {
    char *path = path_of(settings);
    const int code = path != NULL ? cli_temporary_check(path) : cli_out_of_memory("part");
    free(path);
    return code;
}

int trade_write_part(const trade_work *work) {
    trade_head head = {.threads = work->threads,
                       .meshes = work->meshes,
                       .tasks = work->task_count,
                       .texels = work->texels,
                       .covered = work->covered,
                       .fields = work->field_count,
                       .skipped = work->skipped,
                       .truth_s = work->truth_s};
    vshi_part_about about = {.kind = NULL};
    cli_provenance origin = {NULL, NULL, 0};
    vsh_part_options options;
    vsh_error error;
    char *path = path_of(work->settings);
    int code;
    CLI_TRY_DONE(path != NULL ? CLI_OK : cli_out_of_memory("part"));
    CLI_TRY_DONE(trade_part_options(work, &origin, &options));
    CLI_TRY_DONE(list_records(work, &head));
    CLI_TRY_DONE(vshi_part_about_make(TRADE_PART, &options, &about, &error) == VSH_OK ? CLI_OK
                                                                                      : cli_fail(&error));
    code = write(work, path, &head, &about);
done:
    vshi_part_about_free(&about);
    cli_provenance_free(&origin);
    free(head.records);
    free(path);
    return code;
}
