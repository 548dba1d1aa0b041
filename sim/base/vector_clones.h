#pragma once
// One source, several instruction sets.
//
// A function marked TURBIDOCK_VECTOR_CLONES is compiled for plain x86-64, AVX2 and AVX-512; the
// loader takes the widest that the machine has. The clones give the same bits: nothing is
// contracted or reordered (-ffp-contract=off, no -ffast-math), so a digest does not depend on which
// one ran. Mark the outer loop over contiguous data and keep what it calls inline.

#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && \
    !defined(__SANITIZE_ADDRESS__)
#define TURBIDOCK_VECTOR_CLONES __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define TURBIDOCK_VECTOR_CLONES
#endif
