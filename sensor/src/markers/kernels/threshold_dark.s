@ The mask of mono pixels that are not brighter than a limit: see `threshold_dark` in cortex_m7.rs.
@
@ r0 pixels   r1 the limit and one, four times   r2 where the mask goes   r3 its end
@ r4-r9, r12, lr pixels, then their bits   r10 0x80808080   r11 0x00204081
@
@ The sign of half of what a pixel has more than the limit is its bit, at the top of its byte. Those
@ of four pixels and, four places below, of the four before them are brought into the word's top
@ byte by a multiplication: byte i, in parts of eight, times 2^(24 - 7i), and no two of all these
@ products meet in a bit. The order is a search's, judged by LLVM's model of the core: 42
@ instructions and the branch, and 24 cycles.

    .syntax unified
    .section .itcm.hivtac_threshold_dark, "ax", %progbits
    .balign 8
    .global hivtac_threshold_dark
    .type hivtac_threshold_dark, %function
    .thumb_func

hivtac_threshold_dark:
    push   {r4-r11, lr}
    mov.w  r10, #0x80808080
    movw   r11, #0x4081
    movt   r11, #0x0020
.Lhivtac_threshold_dark_word:
    ldr.w  r5, [r0, #4]
    ldr.w  r4, [r0, #0]
    uhsub8 r4, r4, r1
    ldr.w  r9, [r0, #20]
    uhsub8 r5, r5, r1
    ldr.w  r8, [r0, #16]
    ldr.w  r7, [r0, #12]
    ldr.w  r6, [r0, #8]
    uhsub8 r7, r7, r1
    ldr.w  lr, [r0, #24]
    uhsub8 r6, r6, r1
    and.w  r7, r7, r10
    and.w  r5, r5, r10
    and.w  r6, r6, r10
    uhsub8 r8, r8, r1
    and.w  r4, r4, r10
    uhsub8 r9, r9, r1
    ldr.w  r12, [r0, #28]
    uhsub8 lr, lr, r1
    orr.w  r5, r5, r4, lsr #4
    orr.w  r7, r7, r6, lsr #4
    and.w  lr, lr, r10
    and.w  r9, r9, r10
    and.w  r8, r8, r10
    uhsub8 r12, r12, r1
    mul    r5, r5, r11
    orr.w  r9, r9, r8, lsr #4
    and.w  r12, r12, r10
    orr.w  r12, r12, lr, lsr #4
    mul    r7, r7, r11
    lsr.w  r5, r5, #24
    mul    r9, r9, r11
    lsr.w  r7, r7, #24
    mul    r12, r12, r11
    lsr.w  r9, r9, #24
    bfi    r12, r9, #16, #8
    add.w  r0, r0, #32
    bfi    r12, r7, #8, #8
    bfi    r12, r5, #0, #8
    str    r12, [r2], #4
    cmp    r2, r3
    bne.w  .Lhivtac_threshold_dark_word
    pop    {r4-r11, pc}
    .size hivtac_threshold_dark, . - hivtac_threshold_dark
