/* clang says which sanitizer it builds for in gcc's words too: some tests cannot run under one. Include it first. */
#ifndef SGRT_TESTS_SANITIZERS_H
#define SGRT_TESTS_SANITIZERS_H

#if defined(__has_feature)
#if __has_feature(address_sanitizer) && !defined(__SANITIZE_ADDRESS__)
#define __SANITIZE_ADDRESS__ 1
#endif
#if __has_feature(thread_sanitizer) && !defined(__SANITIZE_THREAD__)
#define __SANITIZE_THREAD__ 1
#endif
#endif

#endif
