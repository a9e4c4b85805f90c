/* The folder of new bakes, the child processes that bake into it, and golden bakes that are replaced. */
#include "cli/child.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/regress/regress.h"
#include "cli/temporary.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

/* --- the folder */

enum { ATTEMPTS = 16 };

static const char prefix[] = "vdbshade-regress-", unique[] = "XXXXXX";

static int make_failed(const char *path) {
    cli_say("%s: cannot be made: %s", path, strerror(errno));
    return CLI_FILE;
}

/* Opens a folder, but no link to one; -1 if that fails. */
static int open_folder(int parent, const char *name) {
    return openat(parent, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
}

/* Removes the files of a folder, which has no folders in it. */
static void remove_files(int folder) {
    const int own = dup(folder); /* closedir() closes it */
    DIR *listing = own >= 0 ? fdopendir(own) : NULL;
    if (listing == NULL) {
        if (own >= 0) {
            close(own);
        }
        return;
    }
    rewinddir(listing);
    for (const struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) {
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0) {
            unlinkat(folder, entry->d_name, 0);
        }
    }
    closedir(listing);
}

/* Removes folders of killed runs: those with such a name that belong to this user, and that nobody locks. */
static void remove_old_folders(const char *place) {
    DIR *listing = opendir(place);
    if (listing == NULL) {
        return;
    }
    for (const struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) {
        if (strncmp(entry->d_name, prefix, sizeof prefix - 1) != 0 ||
            strlen(entry->d_name) != sizeof prefix - 1 + sizeof unique - 1) {
            continue;
        }
        const int folder = open_folder(dirfd(listing), entry->d_name);
        struct stat status;
        if (folder >= 0 && fstat(folder, &status) == 0 && status.st_uid == geteuid() &&
            (status.st_mode & 0777) == 0700 && flock(folder, LOCK_EX | LOCK_NB) == 0) {
            remove_files(folder);
            unlinkat(dirfd(listing), entry->d_name, AT_REMOVEDIR);
        }
        if (folder >= 0) {
            close(folder);
        }
    }
    closedir(listing);
}

/* Locks a new folder. Another run may have removed it before, so checks that it still exists. */
static bool lock_folder(int folder, const char *path) {
    struct stat held, there;
    const bool locked =
        flock(folder, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK; /* some file systems have no locks */
    return locked && fstat(folder, &held) == 0 && stat(path, &there) == 0 && held.st_dev == there.st_dev &&
           held.st_ino == there.st_ino;
}

static int make_temporary_folder(regress_work *work) {
    const char *place = getenv("TMPDIR");
    place = place != NULL && place[0] == '/' ? place : "/tmp";
    remove_old_folders(place);
    char name[sizeof prefix + sizeof unique];
    for (int i = 0; i < ATTEMPTS; ++i) {
        snprintf(name, sizeof name, "%s%s", prefix, unique);
        free(work->bakes);
        work->bakes = regress_path(place, name);
        if (work->bakes == NULL) {
            return cli_out_of_memory("folder for new bakes");
        }
        if (mkdtemp(work->bakes) == NULL) {
            break;
        }
        const int folder = open_folder(AT_FDCWD, work->bakes);
        if (folder >= 0 && lock_folder(folder, work->bakes)) {
            work->folder_of_bakes = folder + 1;
            return CLI_OK;
        }
        if (folder >= 0) {
            close(folder);
        }
    }
    cli_say("folder for new bakes: %s: cannot be made: %s", place, strerror(errno));
    return CLI_FILE;
}

int regress_make_folder(regress_work *work) {
    const char *given = work->settings->bakes;
    if (given == NULL) {
        return make_temporary_folder(work);
    }
    if (mkdir(given, 0777) != 0 && errno != EEXIST) {
        return make_failed(given);
    }
    work->bakes = realpath(given, NULL);
    return work->bakes != NULL ? CLI_OK : make_failed(given);
}

void regress_remove_folder(regress_work *work) {
    if (work->folder_of_bakes > 0) {
        remove_files(work->folder_of_bakes - 1);
        rmdir(work->bakes);
        close(work->folder_of_bakes - 1);
        work->folder_of_bakes = 0;
    }
}

/* --- baking */

static int list_words(const regress_work *work, const regress_case *one, regress_lines *words) {
    static const char *const sandbox[] = {[CLI_SANDBOX_OFF] = "off", [CLI_SANDBOX_REQUIRE] = "require"};
    CLI_TRY(regress_add_line(words, "vdbshade"));
    CLI_TRY(regress_add_line(words, "%s", one->command->name));
    /* a scene "--stats=x.json" is a file in the folder, and no option */
    CLI_TRY(regress_add_line(words, "%s%s", one->scene[0] == '-' ? "./" : "", one->scene));
    for (size_t i = 0; i < one->options.count; ++i) {
        CLI_TRY(regress_add_line(words, "%s", one->options.line[i]));
    }
    CLI_TRY(one->output != NULL ? regress_add_line(words, "--output=%s/%s", work->bakes, one->output)
                                : regress_add_line(words, "--output-folder=%s", work->bakes));
    CLI_TRY(regress_add_line(words, "--quiet"));
    CLI_TRY(regress_add_line(words, "--memory-limit=%llu", (unsigned long long)cli_given.memory_limit));
    if (cli_given.threads > 0) {
        CLI_TRY(regress_add_line(words, "--threads=%d", cli_given.threads));
    }
    if (cli_given.sandbox != CLI_SANDBOX_AUTO) {
        CLI_TRY(regress_add_line(words, "--sandbox=%s", sandbox[cli_given.sandbox]));
    }
    return cli_given.allow_outside ? regress_add_line(words, "--allow-outside") : CLI_OK;
}

int regress_bake(const regress_work *work, const regress_case *one) {
    regress_lines words = {NULL, 0};
    int code = list_words(work, one, &words);
    /* in the folder of the scenes, because options name files relative to it */
    code = code == CLI_OK ? cli_in_child(one->scene, work->folder, words.line) : code;
    regress_free_lines(&words);
    return code;
}

/* --- golden bakes */

static int copy(const char *from, const char *to) {
    FILE *file = fopen(from, "rb");
    if (file == NULL) {
        cli_say("%s: cannot be read: %s", from, strerror(errno));
        return CLI_FILE;
    }
    cli_temporary target;
    int code = cli_temporary_begin(&target, to);
    if (code != CLI_OK) {
        fclose(file);
        return code;
    }
    char bytes[65536];
    size_t count;
    while ((count = fread(bytes, 1, sizeof bytes, file)) > 0 &&
           fwrite(bytes, 1, count, target.file) == count) {
    }
    if (ferror(file)) {
        cli_say("%s: cannot be read", from);
        cli_temporary_abandon(&target);
        code = CLI_FILE;
    } else {
        code = cli_temporary_commit(&target);
    }
    fclose(file);
    return code;
}

int regress_update(const regress_work *work, const char *output) {
    if (mkdir(work->golden, 0777) != 0 && errno != EEXIST) {
        return make_failed(work->golden);
    }
    char *from = regress_path(work->bakes, output), *to = regress_path(work->golden, output);
    int code = from != NULL && to != NULL ? cli_check_links(work->golden, to) : cli_out_of_memory(output);
    code = code == CLI_OK ? copy(from, to) : code;
    free(from);
    free(to);
    return code;
}
