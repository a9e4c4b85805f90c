#include "base/part_about.h"

#include "base/try.h"

#include <stdlib.h>
#include <string.h>

void vshi_part_about_free(vshi_part_about *about) {
    for (uint64_t i = 0; about->words != NULL && i < about->word_count; ++i) {
        free(about->words[i]);
    }
    for (uint64_t i = 0; about->attributes != NULL && i < about->attribute_count; ++i) {
        free(about->attributes[i].name);
        free(about->attributes[i].value);
    }
    free(about->attributes);
    free(about->words);
    free(about->version);
    *about = (vshi_part_about){.version = NULL};
}

static bool copy_words(const vshi_part_options *options, vshi_part_about *about) {
    about->words = calloc(options->word_count + 1, sizeof *about->words);
    for (size_t i = 0; about->words != NULL && i < options->word_count; ++i) {
        about->words[about->word_count++] = strdup(options->words[i]);
        if (about->words[i] == NULL) {
            return false;
        }
    }
    return about->words != NULL;
}

static bool copy_attributes(const vshi_part_options *options, vshi_part_about *about) {
    about->attributes = calloc(options->attribute_count + 1, sizeof *about->attributes);
    for (size_t i = 0; about->attributes != NULL && i < options->attribute_count; ++i) {
        vshi_part_attribute *attribute = &about->attributes[about->attribute_count++];
        attribute->name = strdup(options->attributes[i].name);
        attribute->value = strdup(options->attributes[i].value);
        if (attribute->name == NULL || attribute->value == NULL) {
            return false;
        }
    }
    return about->attributes != NULL;
}

vsh_result vshi_part_about_make(const vshi_part_options *options, vshi_part_about *about, vsh_error *error) {
    *about = (vshi_part_about){
        .version = strdup(VSHI_VERSION), .shard = options->shard, .shard_count = options->shard_count};
    return about->version != NULL && copy_words(options, about) && copy_attributes(options, about)
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_MEMORY, "part: the system refused memory");
}

void vshi_part_about_code(vshi_part_code *code, vshi_part_about *about) {
    vshi_part_code_text(code, &about->version);
    vshi_part_code_i32(code, &about->shard);
    vshi_part_code_i32(code, &about->shard_count);
    vshi_part_code_texts(code, &about->words, &about->word_count);
    vshi_part_code_count(code, &about->attribute_count, 2 * sizeof(uint64_t), (void **)&about->attributes,
                         sizeof *about->attributes);
    for (uint64_t i = 0; i < about->attribute_count && !code->failed; ++i) {
        vshi_part_code_text(code, &about->attributes[i].name);
        vshi_part_code_text(code, &about->attributes[i].value);
    }
}

vsh_result vshi_part_refuse(const char *path, const char *what, const char *theirs, const char *ours,
                            vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_INPUT,
                     "%s: is of other inputs or options: its %s is '%.160s', of the others or here '%.160s'; "
                     "bake this part again",
                     path, what, theirs, ours);
}

static vsh_result check_attributes(const vshi_part_about *about, const char *path,
                                   const vshi_part_options *options, vsh_error *error) {
    const vsh_attribute *own = options->attributes;
    const size_t count = options->attribute_count;
    for (size_t i = 0; i < count || i < about->attribute_count; ++i) {
        const vshi_part_attribute *part = i < about->attribute_count ? &about->attributes[i] : NULL;
        const vsh_attribute *here = i < count ? &own[i] : NULL;
        if (part == NULL || here == NULL || strcmp(here->name, part->name) != 0 ||
            strcmp(here->value, part->value) != 0) {
            return vshi_part_refuse(path, here != NULL ? here->name : part->name,
                                    part != NULL ? part->value : "", here != NULL ? here->value : "", error);
        }
    }
    return VSH_OK;
}

vsh_result vshi_part_about_check(const vshi_part_about *about, const char *path, int32_t shard,
                                 const vshi_part_options *options, vsh_error *error) {
    if (strcmp(about->version, VSHI_VERSION) != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: is of vdbshade %.32s, this is %s; bake this part again",
                         path, about->version, VSHI_VERSION);
    }
    if (about->shard != shard || about->shard_count != options->shard_count) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: holds part %d of %d; was it renamed?", path,
                         about->shard, about->shard_count);
    }
    return check_attributes(about, path, options, error);
}
