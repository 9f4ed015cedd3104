@ The mask of RGB565 pixels through a table of bytes: see `threshold_bytes` in cortex_m7.rs.
@
@ r0 pixels   r1 table   r2 where the mask goes   r3 words left   r4-r10 pixels, then their bytes
@ r11 all words in one   r12 the word of the mask   stack: the first pixel
@
@ Each byte's bit 0 goes to its place in the word. A pixel is loaded four before it, and its byte
@ two before; behind the last word these are the first pixels again, so that nothing beyond them is
@ read. The order is a search's, judged by LLVM's model of the core: two words take 202
@ instructions and 104 cycles.

    .syntax unified
    .section .itcm.hivtac_threshold_bytes, "ax", %progbits
    .balign 8
    .global hivtac_threshold_bytes
    .type hivtac_threshold_bytes, %function
    .thumb_func

hivtac_threshold_bytes:
    push   {r0, r4-r11, lr}
    mov    r11, #0
    ldrh   r4, [r0]
    ldrh   r5, [r0, #2]
    ldrb   r4, [r1, r4]
    ldrb   r5, [r1, r5]
    ldrh   r6, [r0, #4]
    ldrh   r7, [r0, #6]
.Lhivtac_threshold_bytes_two:
    bfi    r12, r4, #0, #1
    ldrb.w r6, [r1, r6]
    ldrh.w r8, [r0, #8]
    ldrh.w r9, [r0, #10]
    bfi    r12, r5, #1, #1
    ldrb.w r7, [r1, r7]
    bfi    r12, r6, #2, #1
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
    ldrb.w r8, [r1, r8]
    ldrh.w r4, [r0, #64]
    ldrh.w r6, [r0, #68]
    bfi    r12, r7, #29, #1
    ldrh.w r7, [r0, #70]
    ldrb.w r9, [r1, r9]
    ldrh.w r5, [r0, #66]
    bfi    r12, r8, #30, #1
    ldrb.w r4, [r1, r4]
    bfi    r12, r9, #31, #1
    str    r12, [r2]
    orr    r11, r11, r12
    ldrb.w r5, [r1, r5]
    bfi    r12, r4, #0, #1
    ldrb.w r6, [r1, r6]
    ldrh.w r8, [r0, #72]
    ldrh.w r9, [r0, #74]
    bfi    r12, r5, #1, #1
    ldrb.w r7, [r1, r7]
    bfi    r12, r6, #2, #1
    ldrb.w r9, [r1, r9]
    ldrh.w r10, [r0, #76]
    bfi    r12, r7, #3, #1
    ldrb.w r8, [r1, r8]
    ldrh.w r4, [r0, #78]
    ldrh.w r5, [r0, #80]
    ldrh.w r6, [r0, #82]
    ldrb.w r10, [r1, r10]
    bfi    r12, r8, #4, #1
    bfi    r12, r9, #5, #1
    ldrb.w r4, [r1, r4]
    bfi    r12, r10, #6, #1
    ldrh.w r7, [r0, #84]
    bfi    r12, r4, #7, #1
    ldrb.w r5, [r1, r5]
    ldrb.w r6, [r1, r6]
    ldrh.w r8, [r0, #86]
    bfi    r12, r5, #8, #1
    ldrh.w r9, [r0, #88]
    bfi    r12, r6, #9, #1
    ldrb.w r7, [r1, r7]
    ldrh.w r4, [r0, #90]
    ldrb.w r8, [r1, r8]
    bfi    r12, r7, #10, #1
    ldrh.w r5, [r0, #92]
    bfi    r12, r8, #11, #1
    ldrb.w r9, [r1, r9]
    ldrb.w r4, [r1, r4]
    ldrh.w r6, [r0, #94]
    bfi    r12, r9, #12, #1
    ldrh.w r8, [r0, #98]
    ldrh.w r7, [r0, #96]
    ldrb.w r5, [r1, r5]
    bfi    r12, r4, #13, #1
    ldrb.w r6, [r1, r6]
    bfi    r12, r5, #14, #1
    ldrh.w r9, [r0, #100]
    bfi    r12, r6, #15, #1
    ldrb.w r7, [r1, r7]
    ldrb.w r8, [r1, r8]
    ldrh.w r4, [r0, #102]
    bfi    r12, r7, #16, #1
    ldrh.w r5, [r0, #104]
    bfi    r12, r8, #17, #1
    ldrb.w r9, [r1, r9]
    ldrb.w r4, [r1, r4]
    ldrh.w r6, [r0, #106]
    ldrh.w r8, [r0, #110]
    ldrb.w r5, [r1, r5]
    bfi    r12, r9, #18, #1
    ldrh.w r7, [r0, #108]
    bfi    r12, r4, #19, #1
    ldrb.w r6, [r1, r6]
    bfi    r12, r5, #20, #1
    ldrh.w r9, [r0, #112]
    bfi    r12, r6, #21, #1
    ldrb.w r7, [r1, r7]
    ldrh.w r10, [r0, #114]
    ldrb.w r8, [r1, r8]
    bfi    r12, r7, #22, #1
    ldrh.w r4, [r0, #116]
    bfi    r12, r8, #23, #1
    ldrb.w r9, [r1, r9]
    ldrh.w r5, [r0, #118]
    ldrb.w r10, [r1, r10]
    bfi    r12, r9, #24, #1
    ldrh.w r9, [r0, #126]
    bfi    r12, r10, #25, #1
    ldrh.w r6, [r0, #120]
    ldrb.w r4, [r1, r4]
    ldrh.w r7, [r0, #122]
    ldrh.w r8, [r0, #124]
    ldrb.w r5, [r1, r5]
    bfi    r12, r4, #26, #1
    ldrb.w r6, [r1, r6]
    bfi    r12, r5, #27, #1
    ldrb.w r7, [r1, r7]
    bfi    r12, r6, #28, #1
    add    r0, r0, #128
    subs   r3, r3, #2
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
    str    r12, [r2, #4]
    add    r2, r2, #8
    orr    r11, r11, r12
    ldrb.w r5, [r1, r5]
    bne.w  .Lhivtac_threshold_bytes_two
    mov    r0, r11
    pop    {r3, r4-r11, pc}
    .size hivtac_threshold_bytes, . - hivtac_threshold_bytes
