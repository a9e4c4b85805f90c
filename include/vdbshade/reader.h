/* Files from strangers, parsed where they can do no harm: the program behind vsh_run.reader.
 *
 * A call with a reader starts that program for each file, and waits. Before the child loads the libraries
 * that parse, and before it opens the file, it is confined, in all of its threads:
 *
 * - limits (VSH_CONFINED_LIMITS): data (run->memory_limit, 68 MiB for the program itself, of images 176, and
 *   a stack for each core; the machine's memory where there is no limit), processor time, no core dump, few
 *   descriptors, no new privileges, no longer life than its parent's;
 * - calls (VSH_CONFINED_CALLS): a filter of system calls (seccomp) that leaves reading files, memory and
 *   threads of its own: no sockets, no other program, no file opened for writing, no signal to others. The
 *   kernel is asked of every thread whether it has it; a reader of which one has not reads nothing;
 * - files (VSH_CONFINED_FILES): it can open (Landlock, Linux 5.13) the file and, for a model, its folder;
 *   what libraries lie in; nothing else, and nothing of /proc but its own threads. The memory and environment
 *   of other processes are closed to it. Its own environment has the variables of the dynamic linker, of
 *   locales and of sanitizers alone.
 *
 * Where the system refuses one of them (an old kernel, a container) the rest holds, and a warning says what
 * is missing, but for files, which many systems cannot confine: run->confined makes it an error,
 * vsh_reader_confinement() tells.
 *
 * The child parses, and writes arrays into memory that the caller handed it. When it has ended the caller
 * seals that memory and takes nothing of it for granted: sizes, counts, indices, finite values, transforms,
 * order and alignment of leaves, ends of strings; then come the same checks as without a reader.
 *
 * - A crash is VSH_ERROR_READ ("PATH: damaged: the reader crashed (SIGSEGV)"), a file that takes longer than
 *   run->reader_seconds or more memory than the limit VSH_ERROR_LIMIT.
 * - The progress callback is called about every 20 ms while the reader runs; to cancel kills it at once.
 * - What comes out is the same to the bit as without a reader.
 * - Sanitized builds are not confined, and give no warning of it.
 *
 * Not promised: that the reader cannot read other files of a model's folder, or learn of any path whether it
 * is there, or that what a file shows is right. Scene files, lists of spheres and points are parsed in this
 * process always, by code of ours and Jansson. docs/security.md has the threats, the limits and the gaps. */
#ifndef VDBSHADE_READER_H
#define VDBSHADE_READER_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A reader's only argument. */
#define VSH_READER_ARGUMENT "--vdbshade-reader"

/* As vsh_run.reader: the program vdbshade-reader, which is installed with this library (in libexec) and found
 * from where the library lies. It starts faster than a program that is linked with the library, which has to
 * start twice where libraries have begun threads in it before its main. */
#define VSH_READER "vdbshade-reader"

/* What of a reader is confined: bits. */
enum { VSH_CONFINED_LIMITS = 1, VSH_CONFINED_CALLS = 2, VSH_CONFINED_FILES = 4, VSH_CONFINED_ALL = 7 };

/* For the main of a reader, before anything else, and in a process with no thread that does anything: where
 * argv[1] is VSH_READER_ARGUMENT, confines the process for good, parses the file that the parent asks for and
 * returns the exit code that main is to return; -1 where the argument is not there, which is a common start.
 * A program can so be its own reader ("/proc/self/exe"). Any vdbshade of the same version is one, too.
 * The environment of a reader has VSH_IN_READER. A process with that variable starts no reader: calls with
 * vsh_run.reader fail with VSH_ERROR_ARGUMENT there, so a main that forgets this call cannot start itself
 * again and again. */
VSH_API int32_t vsh_reader_serve(int argc, char **argv);

/* Starts run->reader to see how it is confined here: *confined becomes a sum of VSH_CONFINED_…. Errors:
 * VSH_ERROR_ARGUMENT (no reader given, or none at that place), VSH_ERROR_UNSUPPORTED (run->confined, and not
 * all is had), VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_reader_confinement(const vsh_run *run, uint32_t *confined, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
