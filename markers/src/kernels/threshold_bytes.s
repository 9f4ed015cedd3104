@ The mask of RGB565 pixels through a table of bytes: see `threshold_bytes` in cortex_m7.rs.
@
@ r0 pixels   r1 table   r2 where the mask goes   r3 words left   r4-r10 pixels, then their bytes
@ r12 the word of the mask   stack: the first pixel
@
@ Each byte's bit 0 goes to its place in the word. A pixel is loaded four before it, and its byte
@ two before; behind the last word these are the first pixels again, so that nothing beyond them is
@ read. The order is a search's, judged by LLVM's model of the core: 103 instructions, and
@ 53 cycles.

    .syntax unified
    .section .itcm.hivtac_threshold_bytes, "ax", %progbits
    .balign 8
    .global hivtac_threshold_bytes
    .type hivtac_threshold_bytes, %function
    .thumb_func

hivtac_threshold_bytes:
    push   {r0, r4-r10, lr}
    ldrh   r4, [r0]
    ldrh   r5, [r0, #2]
    ldrb   r4, [r1, r4]
    ldrb   r5, [r1, r5]
    ldrh   r6, [r0, #4]
    ldrh   r7, [r0, #6]
    sub    r2, r2, #4
.Lhivtac_threshold_bytes_word:
    bfi    r12, r4, #0, #1
    ldrb.w r6, [r1, r6]
    ldrh.w r8, [r0, #8]
    ldrh.w r9, [r0, #10]
    bfi    r12, r5, #1, #1
    ldrb.w r7, [r1, r7]
    bfi    r12, r6, #2, #1
    add.w  r2, r2, #4
    ldrb.w r9, [r1, r9]
    ldrh.w r10, [r0, #12]
    bfi    r12, r7, #3, #1
    ldrb.w r8, [r1, r8]
    ldrh.w r4, [r0, #14]
    ldrh.w r5, [r0, #16]
    ldrh.w r6, [r0, #18]
    ldrb.w r10, [r1, r10]
    bfi    r12, r8, #4, #1
    bfi    r12, r9, #5, #1
    ldrb.w r4, [r1, r4]
    bfi    r12, r10, #6, #1
    ldrh.w r7, [r0, #20]
    bfi    r12, r4, #7, #1
    ldrb.w r5, [r1, r5]
    ldrb.w r6, [r1, r6]
    ldrh.w r8, [r0, #22]
    bfi    r12, r5, #8, #1
    ldrh.w r9, [r0, #24]
    bfi    r12, r6, #9, #1
    ldrb.w r7, [r1, r7]
    ldrh.w r4, [r0, #26]
    ldrb.w r8, [r1, r8]
    bfi    r12, r7, #10, #1
    ldrh.w r5, [r0, #28]
    bfi    r12, r8, #11, #1
    ldrb.w r9, [r1, r9]
    ldrb.w r4, [r1, r4]
    ldrh.w r6, [r0, #30]
    bfi    r12, r9, #12, #1
    ldrh.w r8, [r0, #34]
    ldrh.w r7, [r0, #32]
    ldrb.w r5, [r1, r5]
    bfi    r12, r4, #13, #1
    ldrb.w r6, [r1, r6]
    bfi    r12, r5, #14, #1
    ldrh.w r9, [r0, #36]
    bfi    r12, r6, #15, #1
    ldrb.w r7, [r1, r7]
    ldrb.w r8, [r1, r8]
    ldrh.w r4, [r0, #38]
    bfi    r12, r7, #16, #1
    ldrh.w r5, [r0, #40]
    bfi    r12, r8, #17, #1
    ldrb.w r9, [r1, r9]
    ldrb.w r4, [r1, r4]
    ldrh.w r6, [r0, #42]
    ldrh.w r8, [r0, #46]
    ldrb.w r5, [r1, r5]
    bfi    r12, r9, #18, #1
    ldrh.w r7, [r0, #44]
    bfi    r12, r4, #19, #1
    ldrb.w r6, [r1, r6]
    bfi    r12, r5, #20, #1
    ldrh.w r9, [r0, #48]
    bfi    r12, r6, #21, #1
    ldrb.w r7, [r1, r7]
    ldrh.w r10, [r0, #50]
    ldrb.w r8, [r1, r8]
    bfi    r12, r7, #22, #1
    ldrh.w r4, [r0, #52]
    bfi    r12, r8, #23, #1
    ldrb.w r9, [r1, r9]
    ldrh.w r5, [r0, #54]
    ldrb.w r10, [r1, r10]
    bfi    r12, r9, #24, #1
    ldrh.w r9, [r0, #62]
    bfi    r12, r10, #25, #1
    ldrh.w r6, [r0, #56]
    ldrb.w r4, [r1, r4]
    ldrh.w r7, [r0, #58]
    ldrh.w r8, [r0, #60]
    ldrb.w r5, [r1, r5]
    bfi    r12, r4, #26, #1
    ldrb.w r6, [r1, r6]
    bfi    r12, r5, #27, #1
    ldrb.w r7, [r1, r7]
    bfi    r12, r6, #28, #1
    add.w  r0, r0, #64
    subs   r3, r3, #1
    ldrb.w r8, [r1, r8]
    it     eq
    ldreq  r0, [sp]
    ldrh.w r4, [r0, #0]
    ldrh.w r6, [r0, #4]
    bfi    r12, r7, #29, #1
    ldrh.w r7, [r0, #6]
    ldrb.w r9, [r1, r9]
    ldrh.w r5, [r0, #2]
    bfi    r12, r8, #30, #1
    ldrb.w r4, [r1, r4]
    bfi    r12, r9, #31, #1
    str    r12, [r2]
    ldrb.w r5, [r1, r5]
    bne.w  .Lhivtac_threshold_bytes_word
    pop    {r0, r4-r10, pc}
    .size hivtac_threshold_bytes, . - hivtac_threshold_bytes
