@ The mask of RGB565 pixels through a table of bytes: see `threshold_bytes` in cortex_m7.rs.
@
@ r0 pixels   r1 table   r2 where the mask goes   r3 words left   r4-r7, r8-r11 two groups of pixels, then of their bytes
@ r12 the word of the mask   lr from one word's pixels to the next   stack: the first pixel … both steps
@
@ Group i of a word takes its pixels i, i + 8, i + 16 and i + 24: their bytes, side by side, hold their bits as far apart
@ as the mask does. While the bytes of one group are put together, those of the next are loaded; behind the last word these
@ are the first pixels again, so that nothing beyond them is read. The order is a search's, judged by LLVM's model of the
@ core: 112 instructions, and 59 cycles.

    .syntax unified
    .section .itcm.hivtac_threshold_bytes, "ax", %progbits
    .balign 8
    .global hivtac_threshold_bytes
    .type hivtac_threshold_bytes, %function
    .thumb_func

hivtac_threshold_bytes:
    push   {r0, r4-r11, lr}
    ldr    r12, [sp, #44]
    ldr    lr, [sp, #40]
    ldrh   r4, [r0]
    ldrh   r5, [r0, #16]
    ldrh   r6, [r0, #32]
    ldrh   r7, [r0, #48]
    sub    r2, r2, r12
    ldrb   r4, [r1, r4]
    ldrb   r5, [r1, r5]
    ldrb   r6, [r1, r6]
    ldrb   r7, [r1, r7]
.Lhivtac_threshold_bytes_word:
    ldr.w  r12, [sp, #44]
    orr.w  r6, r6, r7, lsl #8
    ldrh.w r11, [r0, #50]
    ldrh.w r8, [r0, #2]
    add.w  r2, r2, r12
    ldrh.w r10, [r0, #34]
    orr.w  r4, r4, r5, lsl #8
    ldrh.w r9, [r0, #18]
    orr.w  r4, r4, r6, lsl #16
    ldrh.w r6, [r0, #36]
    ldrb.w r10, [r1, r10]
    ldrb.w r8, [r1, r8]
    and.w  r4, r4, #0x80808080
    ldrb.w r11, [r1, r11]
    ldrh.w r7, [r0, #52]
    ldrb.w r9, [r1, r9]
    lsr.w  r12, r4, #7
    ldrh.w r4, [r0, #4]
    orr.w  r10, r10, r11, lsl #8
    ldrh.w r11, [r0, #54]
    orr.w  r8, r8, r9, lsl #8
    ldrh.w r5, [r0, #20]
    orr.w  r8, r8, r10, lsl #16
    ldrb.w r6, [r1, r6]
    and.w  r8, r8, #0x80808080
    ldrb.w r7, [r1, r7]
    ldrb.w r5, [r1, r5]
    ldrb.w r4, [r1, r4]
    orr.w  r12, r12, r8, lsr #6
    ldrh.w r8, [r0, #6]
    orr.w  r6, r6, r7, lsl #8
    ldrh.w r9, [r0, #22]
    orr.w  r4, r4, r5, lsl #8
    ldrh.w r10, [r0, #38]
    orr.w  r4, r4, r6, lsl #16
    ldrb.w r8, [r1, r8]
    and.w  r4, r4, #0x80808080
    ldrb.w r9, [r1, r9]
    ldrb.w r11, [r1, r11]
    ldrb.w r10, [r1, r10]
    orr.w  r12, r12, r4, lsr #5
    ldrh.w r4, [r0, #8]
    orr.w  r8, r8, r9, lsl #8
    ldrh.w r5, [r0, #24]
    orr.w  r10, r10, r11, lsl #8
    ldrh.w r7, [r0, #56]
    ldrb.w r4, [r1, r4]
    ldrh.w r6, [r0, #40]
    orr.w  r8, r8, r10, lsl #16
    ldrb.w r5, [r1, r5]
    and.w  r8, r8, #0x80808080
    ldrb.w r7, [r1, r7]
    ldrh.w r11, [r0, #58]
    ldrb.w r6, [r1, r6]
    orr.w  r12, r12, r8, lsr #4
    ldrh.w r8, [r0, #10]
    ldrh.w r9, [r0, #26]
    ldrh.w r10, [r0, #42]
    orr.w  r6, r6, r7, lsl #8
    ldrh.w r7, [r0, #60]
    orr.w  r4, r4, r5, lsl #8
    ldrb.w r8, [r1, r8]
    orr.w  r4, r4, r6, lsl #16
    ldrb.w r10, [r1, r10]
    and.w  r4, r4, #0x80808080
    ldrb.w r9, [r1, r9]
    ldrh.w r6, [r0, #44]
    ldrb.w r11, [r1, r11]
    orr.w  r12, r12, r4, lsr #3
    ldrh.w r4, [r0, #12]
    orr.w  r8, r8, r9, lsl #8
    ldrb.w r7, [r1, r7]
    orr.w  r10, r10, r11, lsl #8
    ldrh.w r5, [r0, #28]
    ldrb.w r4, [r1, r4]
    orr.w  r8, r8, r10, lsl #16
    ldrh.w r10, [r0, #46]
    and.w  r8, r8, #0x80808080
    ldrb.w r6, [r1, r6]
    ldrb.w r5, [r1, r5]
    ldrh.w r11, [r0, #62]
    orr.w  r12, r12, r8, lsr #2
    ldrh.w r8, [r0, #14]
    orr.w  r6, r6, r7, lsl #8
    ldrh.w r9, [r0, #30]
    add.w  r0, r0, lr
    orr.w  r4, r4, r5, lsl #8
    ldrb.w r11, [r1, r11]
    orr.w  r4, r4, r6, lsl #16
    ldrb.w r9, [r1, r9]
    and.w  r4, r4, #0x80808080
    ldrb.w r8, [r1, r8]
    subs   r3, r3, #1
    it     eq
    ldreq.w r0, [sp]
    orr.w  r8, r8, r9, lsl #8
    ldrb.w r10, [r1, r10]
    ldrh.w r6, [r0, #32]
    ldrh.w r7, [r0, #48]
    orr.w  r12, r12, r4, lsr #1
    ldrh.w r4, [r0, #0]
    orr.w  r10, r10, r11, lsl #8
    ldrh.w r5, [r0, #16]
    ldrb.w r7, [r1, r7]
    ldrb.w r6, [r1, r6]
    orr.w  r8, r8, r10, lsl #16
    ldrb.w r4, [r1, r4]
    and.w  r8, r8, #0x80808080
    ldrb.w r5, [r1, r5]
    orr.w  r12, r12, r8
    str    r12, [r2]
    bne.w  .Lhivtac_threshold_bytes_word
    pop    {r0, r4-r11, pc}
    .size hivtac_threshold_bytes, . - hivtac_threshold_bytes
