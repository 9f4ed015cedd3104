@ The mask of YUV422 pixels by their Cr: see `threshold_cr` in cortex_m7.rs.
@
@ r0 pixels   r1 the lowest Cr, four times   r2 where the mask goes   r3 all words in one
@ r4-r10 Cr of pairs   r11 0   r12 the word of the mask   lr 0x03030303
@ stack: where the last two words go
@
@ Group i of a word takes its pairs i, i + 4, i + 8 and i + 12: their Cr, side by side, are compared
@ at once, and choose two bits each, as far apart as the mask has them. While the bytes of one group
@ are put together, those of the next are loaded; the last word loads none. The order is a search's,
@ judged by LLVM's model of the core: two words take 87 instructions and 45 cycles.

    .syntax unified
    .section .itcm.hivtac_threshold_cr, "ax", %progbits
    .balign 8
    .global hivtac_threshold_cr
    .type hivtac_threshold_cr, %function
    .thumb_func

@ Two words of the mask; with \next, what the next ones begin with.
.macro hivtac_threshold_cr_words next
    orr.w  r6, r6, r7, lsl #8
    ldrb.w r9, [r0, #23]
    orr.w  r4, r4, r5, lsl #8
    ldrb.w r7, [r0, #55]
    orr.w  r4, r4, r6, lsl #16
    ldrb.w r8, [r0, #7]
    ldrb.w r6, [r0, #43]
    ldrb.w r10, [r0, #39]
    orr.w  r8, r8, r9, lsl #8
    ldrb.w r5, [r0, #27]
    orr.w  r10, r10, r7, lsl #8
    ldrb.w r7, [r0, #59]
    usub8  r4, r4, r1
    ldrb.w r4, [r0, #11]
    sel    r12, lr, r11
    orr.w  r8, r8, r10, lsl #16
    usub8  r8, r8, r1
    ldrb.w r10, [r0, #47]
    sel    r8, lr, r11
    orr.w  r6, r6, r7, lsl #8
    orr.w  r4, r4, r5, lsl #8
    ldrb.w r7, [r0, #63]
    orr.w  r12, r12, r8, lsl #2
    ldrb.w r9, [r0, #31]
    orr.w  r4, r4, r6, lsl #16
    ldrb.w r8, [r0, #15]
    usub8  r4, r4, r1
    orr.w  r10, r10, r7, lsl #8
    sel    r4, lr, r11
    orr.w  r8, r8, r9, lsl #8
    orr.w  r8, r8, r10, lsl #16
    ldrb.w r5, [r0, #83]
    usub8  r8, r8, r1
    ldrb.w r7, [r0, #115]
    sel    r8, lr, r11
    orr.w  r12, r12, r4, lsl #4
    ldrb.w r4, [r0, #67]
    ldrb.w r6, [r0, #99]
    orr.w  r12, r12, r8, lsl #6
    str    r12, [r2, #0]
    orr.w  r6, r6, r7, lsl #8
    ldrb.w r9, [r0, #87]
    ldrb.w r8, [r0, #71]
    orr.w  r4, r4, r5, lsl #8
    ldrb.w r7, [r0, #119]
    orr.w  r4, r4, r6, lsl #16
    ldrb.w r10, [r0, #103]
    orr.w  r8, r8, r9, lsl #8
    ldrb.w r6, [r0, #107]
    usub8  r4, r4, r1
    ldrb.w r5, [r0, #91]
    orr.w  r10, r10, r7, lsl #8
    ldrb.w r4, [r0, #75]
    orr.w  r3, r3, r12
    ldrb.w r7, [r0, #123]
    sel    r12, lr, r11
    orr.w  r8, r8, r10, lsl #16
    usub8  r8, r8, r1
    ldrb.w r10, [r0, #111]
    sel    r8, lr, r11
    orr.w  r4, r4, r5, lsl #8
    orr.w  r6, r6, r7, lsl #8
    ldrb.w r7, [r0, #127]
    orr.w  r12, r12, r8, lsl #2
    ldrb.w r9, [r0, #95]
    orr.w  r4, r4, r6, lsl #16
    ldrb.w r8, [r0, #79]
    usub8  r4, r4, r1
    orr.w  r10, r10, r7, lsl #8
    sel    r4, lr, r11
    orr.w  r8, r8, r9, lsl #8
    orr.w  r8, r8, r10, lsl #16
    usub8  r8, r8, r1
    .if \next
    ldrb.w r5, [r0, #147]
    .endif
    sel    r8, lr, r11
    orr.w  r12, r12, r4, lsl #4
    .if \next
    ldrb.w r7, [r0, #179]
    ldrb.w r6, [r0, #163]
    .endif
    orr.w  r12, r12, r8, lsl #6
    str    r12, [r2, #4]
    .if \next
    add    r2, r2, #8
    .endif
    orr.w  r3, r3, r12
    .if \next
    ldr    r12, [sp]
    ldrb.w r4, [r0, #131]
    add    r0, r0, #128
    cmp    r2, r12
    .endif
.endm

hivtac_threshold_cr:
    sub    r3, r3, #8
    push   {r3-r11, lr}
    mov    lr, #0x03030303
    ldrb   r4, [r0, #3]
    mov    r11, #0
    ldrb   r5, [r0, #19]
    cmp    r2, r3
    ldrb   r6, [r0, #35]
    mov    r3, #0
    ldrb   r7, [r0, #51]
    beq.w  .Lhivtac_threshold_cr_last
.Lhivtac_threshold_cr_two:
    hivtac_threshold_cr_words 1
    bne.w  .Lhivtac_threshold_cr_two
.Lhivtac_threshold_cr_last:
    hivtac_threshold_cr_words 0
    mov    r0, r3
    pop    {r3-r11, pc}
    .size hivtac_threshold_cr, . - hivtac_threshold_cr
